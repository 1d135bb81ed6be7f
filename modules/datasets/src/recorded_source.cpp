#include "etalon/datasets/recorded_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <tuple>

#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "etalon/datasets/ground_truth_file.h"
#include "etalon/imu/imu_limits.h"
#include "image_file.h"
#include "missing_images.h"
#include "stamped_rows.h"

namespace etalon {

namespace {

/** `t + seconds`, held at the ends of int64 for ranges without limit. */
TimeNs shifted(TimeNs t, double seconds) {
  constexpr double kUnlimitedS = 4e9;  // over a century; the sum stays far inside int64
  if (seconds > kUnlimitedS) return std::numeric_limits<TimeNs>::max();
  if (seconds < -kUnlimitedS) return std::numeric_limits<TimeNs>::min();
  return t + durationNs(seconds);
}

/** No image can be read: names the first one. */
[[noreturn]] void failWithoutImages(const std::string& name, const std::string& kind,
                                    const ReadStatistics& statistics, const LoadedFrame& last) {
  std::string file = last.file, problem = last.problem;
  for (const std::string& warning : statistics.warnings) {
    const size_t mark = warning.find(kSkippedMark);
    if (mark == std::string::npos) continue;
    file = warning.substr(0, mark);
    problem = warning.substr(mark + std::string(kSkippedMark).size());
    break;
  }
  std::string advice;
  std::error_code ignored;
  if (file != name && !std::filesystem::exists(file, ignored)) advice = adviceOnMissingImages(kind);
  throw DataError(file, 0,
                  problem + " (of " + std::to_string(statistics.unreadable_images) +
                      " stereo pairs none can be read)" + advice);
}

}  // namespace

std::string describe(const LoadedFrame& loaded) {
  return loaded.problem.empty() ? std::string() : loaded.file + ": " + loaded.problem;
}

RecordedSource::RecordedSource(std::string name, std::string kind,
                               std::unique_ptr<RecordingReader> reader,
                               const SourceOptions& options)
    : name_(std::move(name)),
      kind_(std::move(kind)),
      reader_(std::move(reader)),
      recording_(reader_->read()),
      options_(options) {
  if (recording_.image_stamps.empty())
    throw DataError(name_, 0,
                    "no stereo pair was found; expected left and right images with equal stamps");
  if (recording_.imu.size() < 2)
    throw DataError(name_, 0, "expected IMU samples with stamps of their own");
  checkStampUnit();
  if (std::isnan(options_.from_s) || std::isnan(options_.to_s) || options_.to_s < options_.from_s)
    throw ConfigError("expected a range --from <= --to in seconds");
  if (!options_.ground_truth.empty())
    recording_.ground_truth = readGroundTruth(options_.ground_truth);
  checkImuRate();
  for (const std::string& sentence : recording_.warnings) warn(sentence);
  selectRange();
  countUnpaired();
  countOutsideImu();
}

/** No stereo camera takes a thousand pairs a second: stamps that say so count in another unit. */
void RecordedSource::checkStampUnit() const {
  constexpr double kFastestHz = 1000.0;
  const std::vector<TimeNs>& stamps = recording_.image_stamps;
  if (stamps.size() < 2) return;
  const double rate_hz =
      static_cast<double>(stamps.size() - 1) / secondsBetween(stamps.front(), stamps.back());
  if (!(rate_hz > kFastestHz)) return;
  const bool micro = rate_hz < 1e3 * kFastestHz;
  throw DataError(name_, 0,
                  format("the stamps of the images say %.3g Hz; expected nanoseconds, are they %s? "
                         "then multiply those of images, IMU and ground truth by %s",
                         rate_hz, micro ? "microseconds" : "milliseconds", micro ? "1000" : "1e6"));
}

/** What counts as a gap depends on the rate. */
void RecordedSource::checkImuRate() {
  constexpr double kFaster = 1.5;
  const Steps steps = stepsOf(recording_.imu);
  if (steps.inBatches())
    recording_.warnings.push_back(
        name_ + format(": IMU samples come in batches, one every %.4g ms on average; are they "
                       "stamped when they arrive? That costs accuracy",
                       1e3 * steps.mean_s));
  double& rate_hz = recording_.calibration.imu.rate_hz;
  const double measured_hz = steps.rateHz();
  if (rate_hz <= kFaster * measured_hz) return;
  recording_.warnings.push_back(
      name_ +
      format(": the calibration says that the IMU has %.4g Hz, its stamps say %.4g Hz, which "
             "is used",
             rate_hz, measured_hz));
  rate_hz = measured_hz;
}

void RecordedSource::selectRange() {
  const std::vector<TimeNs>& stamps = recording_.image_stamps;
  range_begin_ = shifted(stamps.front(), options_.from_s);
  range_end_ = shifted(stamps.front(), options_.to_s);
  frame_ = std::lower_bound(stamps.begin(), stamps.end(), range_begin_) - stamps.begin();
  frame_end_ = std::upper_bound(stamps.begin(), stamps.end(), range_end_) - stamps.begin();
  if (frame_ == frame_end_)
    throw DataError(name_, 0,
                    "no image lies in the range from " + std::to_string(options_.from_s) +
                        " s; expected a part of the recording's " +
                        std::to_string(secondsBetween(stamps.front(), stamps.back())) + " s");

  const auto before = [](const ImuSample& sample, TimeNs t) { return sample.t < t; };
  const std::vector<ImuSample>& imu = recording_.imu;
  const TimeNs last = stamps[frame_end_ - 1];
  const TimeNs imu_begin = shifted(stamps[frame_], -options_.imu_margin_s);
  const TimeNs imu_end = std::min(range_end_, shifted(last, options_.imu_margin_s));
  imu_ = std::lower_bound(imu.begin(), imu.end(), imu_begin, before) - imu.begin();
  // One sample further if the last image would lie outside the IMU's time otherwise.
  imu_end_ = imu_;
  while (imu_end_ < imu.size() && imu[imu_end_].t <= imu_end) ++imu_end_;
  if (imu_end_ < imu.size() && (imu_end_ == 0 || imu[imu_end_ - 1].t < last)) ++imu_end_;
}

void RecordedSource::countUnpaired() {
  const auto count = [&](const std::vector<TimeNs>& stamps) {
    return std::count_if(stamps.begin(), stamps.end(),
                         [&](TimeNs t) { return range_begin_ <= t && t <= range_end_; });
  };
  statistics_.unpaired_left = count(recording_.unpaired_left);
  statistics_.unpaired_right = count(recording_.unpaired_right);
}

void RecordedSource::countOutsideImu() {
  const std::vector<TimeNs>& stamps = recording_.image_stamps;
  const TimeNs first = recording_.imu.front().t, last = recording_.imu.back().t;
  for (size_t i = frame_; i < frame_end_; ++i)
    if (stamps[i] < first || stamps[i] > last) ++statistics_.outside_imu;
  if (statistics_.outside_imu == 0) return;
  const std::string text = format(
      ": %d of %zu stereo frames lie outside the IMU's time, %.2f to %.2f s after the "
      "first image: they are used without IMU; are the clocks the same?",
      statistics_.outside_imu, frame_end_ - frame_, secondsBetween(stamps.front(), first),
      secondsBetween(stamps.front(), last));
  warn(name_ + text);
}

void RecordedSource::warn(const std::string& sentence) {
  if (statistics_.warnings.size() < ReadStatistics::kMaxWarnings)
    statistics_.warnings.push_back(sentence);
}

std::optional<SensorEvent> RecordedSource::next() {
  for (;;) {
    const bool have_imu = imu_ < imu_end_;
    const bool have_frame = frame_ < frame_end_;
    if (!have_imu && !have_frame) return std::nullopt;
    if (have_imu && (!have_frame || recording_.imu[imu_].t <= recording_.image_stamps[frame_])) {
      ++statistics_.imu_samples;
      return recording_.imu[imu_++];
    }
    if (std::optional<StereoFrame> frame = nextFrame()) return *frame;
  }
}

std::vector<ImuSample> RecordedSource::imuMeasurements() const {
  std::vector<ImuSample> measurements;
  std::copy_if(recording_.imu.begin(), recording_.imu.end(), std::back_inserter(measurements),
               [](const ImuSample& sample) { return isMeasurement(sample); });
  return measurements;
}

LoadedFrame RecordedSource::checkFrame(size_t index) const {
  LoadedFrame result;
  result.frame.t = recording_.image_stamps[index];
  std::tie(result.frame.left_path, result.frame.right_path) = reader_->paths(index);
  const std::string* const paths[] = {&result.frame.left_path, &result.frame.right_path};
  for (size_t c = 0; c < 2 && result.problem.empty(); ++c) {
    if (paths[c]->empty()) continue;
    result.file = *paths[c];
    result.problem = checkImageFile(result.file, recording_.calibration.cameras[c].model);
  }
  return result;
}

std::optional<StereoFrame> RecordedSource::nextFrame() {
  const bool check_only = !options_.decode_images && options_.check_images;
  LoadedFrame result =
      check_only ? checkFrame(frame_) : reader_->load(frame_, options_.decode_images);
  ++frame_;
  if (result.problem.empty()) {
    ++statistics_.stereo_frames;
    return std::move(result.frame);
  }
  ++statistics_.unreadable_images;
  warn(result.file + kSkippedMark + result.problem);
  if (frame_ == frame_end_ && statistics_.stereo_frames == 0)
    failWithoutImages(name_, kind_, statistics_, result);
  return std::nullopt;
}

}  // namespace etalon
