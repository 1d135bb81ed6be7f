#include "etalon/datasets/recording_info.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "etalon/core/so3.h"
#include "etalon/datasets/recording_checks.h"
#include "etalon/imu/imu_limits.h"
#include "sentence.h"

namespace etalon {

namespace {

template <typename Elements>
std::vector<TimeNs> stampsOf(const Elements& elements) {
  std::vector<TimeNs> stamps;
  stamps.reserve(elements.size());
  for (const auto& element : elements) stamps.push_back(element.t);
  return stamps;
}

/** Well above the 2 to 3 deg that a few seconds of motion leave open. */
constexpr double kMaxRotationErrorDeg = 20.0;

/** Real motion tracked in real images lies above 0.9. */
constexpr double kPoorCorrelation = 0.8;
/** Spread of the gyro's rotations from image to image that images certainly show: vision errs by 1
 * to 3 mrad. */
constexpr double kTurningRad = 6e-3;

class Inspector {
 public:
  Inspector(RecordedSource& source, RecordingInfo* info) : source_(source), info_(*info) {}

  /** Looks at every image file's header; what decoding showed beyond that is in `decoded`. */
  void lookAtImages(const ImageProblems& decoded) {
    for (size_t i = 0; i < source_.imageStamps().size(); ++i) {
      const FrameLoader::Result header = source_.checkFrame(i);
      std::string problem = describe(header);
      const auto found = decoded.find(i);
      if (problem.empty() && found != decoded.end()) problem = found->second;
      if (problem.empty()) continue;
      if (i == 0) first_pair_ = problem;
      std::error_code error;
      if (!header.problem.empty() && !std::filesystem::exists(header.file, error)) {
        ++info_.missing_images;
      } else if (info_.unusable_images++ == 0) {
        first_unusable_ = problem;
      }
    }
  }

  void inspect(const RecordingFindings& images) {
    checkStreams();
    checkImageFiles();
    take(checkCalibration(source_));
    take(checkImu(source_));
    take(checkRepeatedImages(source_));
    take(images);
    checkRotation();
    checkGyro();
    checkCorrelation();
    checkTimeOffset();
  }

 private:
  void warn(const std::string& sentence) { info_.warnings.push_back(sentence); }
  void take(const RecordingFindings& found) {
    info_.errors.insert(info_.errors.end(), found.errors.begin(), found.errors.end());
    for (const std::string& sentence : found.warnings) warn(sentence);
  }

  void checkStream(const StreamSummary& stream, double nominal_hz, const char* name) {
    if (!stream.gaps.empty()) {
      const auto longest =
          std::max_element(stream.gaps.begin(), stream.gaps.end(),
                           [](const auto& a, const auto& b) { return a.length_s < b.length_s; });
      warn(format("%s: %zu %s, the longest of %.4f s after stamp %lld (median step %.4f s)", name,
                  stream.gaps.size(), stream.gaps.size() == 1 ? "gap" : "gaps", longest->length_s,
                  static_cast<long long>(longest->after), 1.0 / stream.rate_hz));
    }
    if (nominal_hz > 0 && stream.rate_hz > 0 && std::abs(stream.rate_hz / nominal_hz - 1) > 0.1)
      warn(format("%s: the calibration says %.4g Hz, the stamps say %.4g Hz", name, nominal_hz,
                  stream.rate_hz));
  }

  void checkStreams() {
    checkStream(info_.images, info_.calibration.cameras[0].rate_hz, "images");
    checkStream(info_.imu, info_.calibration.imu.rate_hz, "IMU");
    if (info_.ground_truth.count > 0 && (info_.ground_truth.last < info_.images.first ||
                                         info_.ground_truth.first > info_.images.last))
      warn("ground truth: its time does not overlap that of the images; are the clocks the same?");
  }

  void checkImageFiles() {
    if (info_.missing_images > 0)
      warn(format("images: the files of %d of %zu pairs do not exist", info_.missing_images,
                  info_.images.count));
    if (info_.unusable_images > 0)
      warn(format("images: %d of %zu pairs cannot be used, the first because of ",
                  info_.unusable_images, info_.images.count) +
           first_unusable_);
    if (!first_pair_.empty()) warn("images: no run can start at the first pair: " + first_pair_);
  }

  /** The camera's rotation against the gyro's: the motion shows a swapped axis or an inverted T_BS.
   */
  void checkRotation() {
    if (!info_.time_offset.clear || !info_.time_offset.R_CB) return;
    const Eigen::Matrix3d& R_BC = info_.calibration.cameras[0].T_BC.R;
    const double angle_deg = logSO3(*info_.time_offset.R_CB * R_BC).norm() * 180.0 / M_PI;
    info_.rotation_disagreement_deg = angle_deg;
    if (angle_deg > kMaxRotationErrorDeg)
      warn(format(
          "extrinsics: the rotation of cam0 to the IMU differs by %.0f deg from what gyro and "
          "images say; is T_BS sensor to body?",
          angle_deg));
  }

  void checkGyro() {
    const TimeOffsetEstimate& offset = info_.time_offset;
    if (offset.clear && offset.gyro_scale > 30 && offset.gyro_scale < 110)
      warn(
          format("IMU: the gyro's rates are %.1f times the camera's; the gyro seems to be in "
                 "deg/s, expected rad/s",
                 offset.gyro_scale));
    else if (offset.clear && (offset.gyro_scale < 0.6 || offset.gyro_scale > 1.6))
      warn(format("IMU: the gyro's rates are %.3f times the camera's; expected 1",
                  offset.gyro_scale));
  }

  /** Gyro and camera turn, but not alike: neither units nor extrinsics nor a time offset do that.
   */
  void checkCorrelation() {
    const TimeOffsetEstimate& offset = info_.time_offset;
    if (!offset.estimated || offset.correlation >= kPoorCorrelation ||
        offset.gyro_spread_rad < kTurningRad)
      return;
    const bool mirrored = offset.correlation_mirrored > offset.correlation + 0.1;
    warn(format("IMU: the gyro turns, but not as the images do (correlation %.3f); %s",
                offset.correlation,
                mirrored ? format("with one axis of the gyro inverted it is %.3f: is a sign wrong?",
                                  offset.correlation_mirrored)
                               .c_str()
                         : "are axes exchanged or scaled, or do the streams belong together?"));
  }

  void checkTimeOffset() {
    const TimeOffsetEstimate& offset = info_.time_offset;
    const double half_period = info_.images.rate_hz > 0 ? 0.5 / info_.images.rate_hz : 0.025;
    if (offset.discernible() && std::abs(offset.offset_s) > half_period)
      warn(
          format("time offset: the images show the gyro's motion of %.1f ms %s (correlation %.3f, "
                 "%.3f without offset); are the clocks synchronised?",
                 1e3 * std::abs(offset.offset_s), offset.offset_s > 0 ? "later" : "earlier",
                 offset.correlation, offset.correlation_at_zero));
  }

  RecordedSource& source_;
  RecordingInfo& info_;
  std::string first_unusable_, first_pair_;  ///< what is wrong with them; empty if nothing
};

}  // namespace

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

RecordingInfo describeRecording(RecordedSource& source, const InfoOptions& options) {
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
  double norms = 0, samples = 0;
  for (const ImuSample& sample : source.imuSamples())
    if (isMeasurement(sample)) norms += sample.accel.norm(), samples += 1;
  if (samples > 0) info.mean_accel_norm = norms / samples;
  ImageProblems problems;
  if (options.max_frames > 0) {
    const FrameLoader::Result first = source.loadFrame(0);  // what every run begins with
    if (!first.problem.empty()) problems[0] = describe(first);
    info.time_offset =
        estimateTimeOffset(measureCameraRotation(source, options.max_frames, &problems),
                           source.imuSamples(), options.max_offset_s);
  } else {
    info.time_offset.reason = "not asked for";
  }
  info.warnings = source.statistics().warnings;
  RecordingFindings images;
  if (options.max_frames > 0) images = checkImages(*openRecording(source.name()));
  Inspector inspector(source, &info);
  inspector.lookAtImages(problems);
  inspector.inspect(images);
  return info;
}

}  // namespace etalon
