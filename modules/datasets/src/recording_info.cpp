#include "etalon/datasets/recording_info.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/datasets/recording_checks.h"
#include "missing_images.h"
#include "stamped_rows.h"

namespace etalon {

namespace {

class Inspector {
 public:
  Inspector(const RecordedSource& source, RecordingInfo* info) : source_(source), info_(*info) {}

  /** Looks at every image file's header; what decoding showed beyond that is in `decoded`. */
  void lookAtImages(const ImageProblems& decoded) {
    for (size_t i = 0; i < source_.imageStamps().size(); ++i) {
      const LoadedFrame header = source_.checkFrame(i);
      std::string problem = describe(header);
      const auto found = decoded.find(i);
      if (problem.empty() && found != decoded.end()) problem = found->second;
      if (problem.empty()) continue;
      std::error_code error;
      if (!header.problem.empty() && !std::filesystem::exists(header.file, error)) {
        ++info_.missing_images;
      } else if (info_.unusable_images++ == 0) {
        first_unusable_ = problem;
      }
    }
  }

  void inspect() {
    checkStreams();
    checkImageFiles();
    info_.append(checkCalibration(source_));
    info_.append(checkImu(source_));
    info_.append(checkRepeatedImages(source_));
  }

 private:
  void warn(const std::string& sentence) { info_.warnings.push_back(sentence); }

  void checkStream(const StreamSummary& stream, double nominal_hz, const char* name) {
    if (!stream.gaps.empty()) {
      const auto longest =
          std::max_element(stream.gaps.begin(), stream.gaps.end(),
                           [](const auto& a, const auto& b) { return a.length_s < b.length_s; });
      double missing = 0.0;
      for (const auto& gap : stream.gaps)
        missing += std::max(0.0, std::round(gap.length_s * stream.rate_hz) - 1.0);
      warn(
          format("%s: %s, the longest of %.4f s after stamp %lld (median step %.4f s); %.2g %% is "
                 "missing",
                 name, counted(stream.gaps.size(), "gap").c_str(), longest->length_s,
                 static_cast<long long>(longest->after), 1.0 / stream.rate_hz,
                 100.0 * missing / (missing + static_cast<double>(stream.count))));
    }
    if (nominal_hz > 0 && stream.rate_hz > 0 && std::abs(stream.rate_hz / nominal_hz - 1) > 0.1)
      warn(format("%s: the calibration says %.4g Hz, the stamps say %.4g Hz", name, nominal_hz,
                  stream.rate_hz));
  }

  void checkStreams() {
    if (info_.images.first > info_.imu.last || info_.images.last < info_.imu.first)
      info_.errors.push_back(
          format("images: none of the %zu pairs lies within the IMU's time, %.2f to %.2f s after "
                 "the first image; expected images and IMU on the same clock",
                 info_.images.count, secondsBetween(info_.images.first, info_.imu.first),
                 secondsBetween(info_.images.first, info_.imu.last)));
    else
      checkEndOfImages();
    checkStream(info_.images, info_.calibration.cameras[0].rate_hz, "images");
    checkStream(info_.imu, info_.calibration.imu.rate_hz, "IMU");
    if (info_.ground_truth.count > 0 && (info_.ground_truth.last < info_.images.first ||
                                         info_.ground_truth.first > info_.images.last))
      warn("ground truth: its time does not overlap that of the images; are the clocks the same?");
  }

  /** A camera that failed, or images that were not copied whole. */
  void checkEndOfImages() {
    constexpr double kLongS = 5.0;
    const double imu_alone_s = secondsBetween(info_.images.last, info_.imu.last);
    if (imu_alone_s <= kLongS) return;
    warn(format("images: they end %.1f s before the IMU does; a run ends with them", imu_alone_s));
  }

  void checkImageFiles() {
    // With no pair at all no run can start.
    const size_t bad = static_cast<size_t>(info_.missing_images + info_.unusable_images);
    std::vector<std::string>& found = bad == info_.images.count ? info_.errors : info_.warnings;
    if (info_.missing_images > 0)
      found.push_back(format("images: the files of %d of %zu pairs do not exist",
                             info_.missing_images, info_.images.count) +
                      adviceOnMissingImages(info_.kind));
    if (info_.unusable_images > 0)
      found.push_back(format("images: %d of %zu pairs cannot be used, the first because of ",
                             info_.unusable_images, info_.images.count) +
                      first_unusable_);
  }

  const RecordedSource& source_;
  RecordingInfo& info_;
  std::string first_unusable_;  ///< what is wrong with it; empty if nothing
};

}  // namespace

void RecordingInfo::append(const RecordingFindings& found) {
  errors.insert(errors.end(), found.errors.begin(), found.errors.end());
  warnings.insert(warnings.end(), found.warnings.begin(), found.warnings.end());
}

StreamSummary summarize(const std::vector<TimeNs>& stamps) {
  StreamSummary summary;
  summary.count = stamps.size();
  if (stamps.empty()) return summary;
  summary.first = stamps.front();
  summary.last = stamps.back();
  summary.duration_s = secondsBetween(summary.first, summary.last);
  std::vector<double> steps;
  for (size_t i = 1; i < stamps.size(); ++i)
    steps.push_back(secondsBetween(stamps[i - 1], stamps[i]));
  if (steps.empty()) return summary;
  const double typical = median(steps);
  summary.rate_hz = 1.0 / typical;
  for (size_t i = 0; i < steps.size(); ++i) {
    summary.longest_step_s = std::max(summary.longest_step_s, steps[i]);
    if (steps[i] > 1.5 * typical) summary.gaps.push_back({stamps[i], steps[i]});
  }
  return summary;
}

RecordingInfo describeRecording(const RecordedSource& source, const ImageProblems& decoded) {
  RecordingInfo info;
  info.name = source.name();
  info.kind = source.kind();
  info.calibration = source.calibration();
  info.images = summarize(source.imageStamps());
  info.imu = summarize(stampsOf(source.imuSamples()));
  info.ground_truth = summarize(stampsOf(source.groundTruth().states));
  info.ground_truth_velocity = source.groundTruth().has_velocity;
  info.ground_truth_biases = source.groundTruth().has_biases;
  info.unpaired_left = source.statistics().unpaired_left;
  info.unpaired_right = source.statistics().unpaired_right;
  const std::vector<ImuSample> imu = source.imuMeasurements();
  double norms = 0;
  for (const ImuSample& sample : imu) norms += sample.accel.norm();
  if (!imu.empty()) info.mean_accel_norm = norms / static_cast<double>(imu.size());
  info.warnings = source.statistics().warnings;
  Inspector inspector(source, &info);
  inspector.lookAtImages(decoded);
  inspector.inspect();
  return info;
}

}  // namespace etalon
