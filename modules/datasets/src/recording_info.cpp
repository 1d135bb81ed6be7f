#include "etalon/datasets/recording_info.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>

#include "etalon/core/so3.h"

namespace etalon {

namespace {

template <typename Elements>
std::vector<TimeNs> stampsOf(const Elements& elements) {
  std::vector<TimeNs> stamps;
  stamps.reserve(elements.size());
  for (const auto& element : elements) stamps.push_back(element.t);
  return stamps;
}

__attribute__((format(printf, 1, 2))) std::string format(const char* text, ...) {
  char buffer[400];
  va_list arguments;
  va_start(arguments, text);
  std::vsnprintf(buffer, sizeof buffer, text, arguments);
  va_end(arguments);
  return buffer;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/**
 * Standard deviation of white noise in the quietest half second of one channel, from second
 * differences (which a smooth motion hardly enters; the variance of a - 2b + c is six times that of
 * the noise). An upper bound of the noise.
 */
double quietestNoise(const std::vector<ImuSample>& imu, double rate_hz,
                     Eigen::Vector3d ImuSample::*channel) {
  const size_t window = std::max<size_t>(20, static_cast<size_t>(0.5 * rate_hz));
  double quietest = -1;
  for (size_t first = 0; first + window + 2 <= imu.size(); first += window) {
    double sum = 0;
    for (size_t i = first; i < first + window; ++i)
      sum += (imu[i].*channel - 2 * imu[i + 1].*channel + imu[i + 2].*channel).squaredNorm();
    const double sigma = std::sqrt(sum / (6.0 * 3.0 * static_cast<double>(window)));
    if (quietest < 0 || sigma < quietest) quietest = sigma;
  }
  return quietest;
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

  void inspect() {
    checkStreams();
    checkImageFiles();
    checkExtrinsics();
    checkAccelerometer();
    checkGyro();
    checkCorrelation();
    checkNoise();
    checkTimeOffset();
  }

 private:
  void warn(const std::string& sentence) { info_.warnings.push_back(sentence); }

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

  void checkExtrinsics() {
    const double baseline = info_.calibration.baseline();
    if (baseline < 5e-3 || baseline > 5.0)
      warn(format("extrinsics: a stereo baseline of %.4g m is unlikely; is T_BS in metres?",
                  baseline));
    checkRotation();
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

  void checkAccelerometer() {
    const double norm = info_.mean_accel_norm;
    if (norm > 0.5 && norm < 2.0)
      warn(
          format("IMU: the mean acceleration is %.3f; the accelerometer seems to be in g, "
                 "expected m/s^2",
                 norm));
    else if (norm < 0.5)
      warn(
          format("IMU: the mean acceleration is %.3f m/s^2; expected specific force, gravity "
                 "(9.81) included",
                 norm));
    else if (norm < 7.0 || norm > 13.0)
      warn(format("IMU: the mean acceleration is %.3f m/s^2; expected about 9.81", norm));
  }

  void checkGyro() {
    const TimeOffsetEstimate& offset = info_.time_offset;
    std::vector<double> rates;
    for (const ImuSample& sample : source_.imuSamples()) rates.push_back(sample.gyro.norm());
    const double typical = median(rates);
    const double largest = rates.empty() ? 0 : *std::max_element(rates.begin(), rates.end());
    // 35 rad/s is the full scale of usual gyros (2000 deg/s); 5 rad/s is more than vision can
    // follow for long.
    const bool too_fast = largest > 35.0 || typical > 5.0;
    if (offset.clear && offset.gyro_scale > 30 && offset.gyro_scale < 110)
      warn(
          format("IMU: the gyro's rates are %.1f times the camera's; the gyro seems to be in "
                 "deg/s, expected rad/s",
                 offset.gyro_scale));
    else if (offset.clear && (offset.gyro_scale < 0.6 || offset.gyro_scale > 1.6))
      warn(format("IMU: the gyro's rates are %.3f times the camera's; expected 1",
                  offset.gyro_scale));
    else if (too_fast)
      warn(
          format("IMU: gyro rates of %.3g (median) and %.3g (largest) are unlikely in rad/s; are "
                 "they in deg/s?",
                 typical, largest));
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

  void checkNoise() {
    const ImuNoiseDensities& noise = info_.calibration.imu.noise;
    // Continuous-time densities of MEMS sensors lie between 1e-5 and 1e-3 rad/s/sqrt(Hz), 1e-4 and
    // 1e-2 m/s^2/sqrt(Hz); a discrete-time sigma at 200 Hz is 14 times its density.
    checkDensity("gyroscope_noise_density", noise.gyro_noise_density, 1e-6, 2e-3, "rad/s/sqrt(Hz)",
                 &ImuSample::gyro);
    checkDensity("accelerometer_noise_density", noise.accel_noise_density, 1e-5, 2e-2,
                 "m/s^2/sqrt(Hz)", &ImuSample::accel);
    checkWalk("gyroscope_random_walk", noise.gyro_random_walk, 1e-2, "rad/s^2/sqrt(Hz)");
    checkWalk("accelerometer_random_walk", noise.accel_random_walk, 1e-1, "m/s^3/sqrt(Hz)");
  }

  void checkDensity(const char* key, double density, double least, double most, const char* unit,
                    Eigen::Vector3d ImuSample::*channel) {
    const double measured = quietestNoise(source_.imuSamples(), info_.imu.rate_hz, channel);
    const double sigma = density * std::sqrt(info_.imu.rate_hz);
    if (density <= 0)
      warn(format("noise model: %s is zero; expected a continuous-time density in %s", key, unit));
    else if (density < least)
      warn(format("noise model: %s = %.3g %s is implausibly small", key, density, unit));
    else if (density > most)
      warn(
          format("noise model: %s = %.3g %s is implausibly large; is it a discrete-time sigma? "
                 "expected a continuous-time density (sigma divided by sqrt(rate))",
                 key, density, unit));
    else if (measured > 0 && sigma > 8 * measured)
      warn(
          format("noise model: %s = %.3g %s means a sigma of %.3g a sample, the quietest half "
                 "second has %.3g; is it a discrete-time sigma?",
                 key, density, unit, sigma, measured));
  }

  void checkWalk(const char* key, double density, double most, const char* unit) {
    if (density <= 0)
      warn(format("noise model: %s is zero; expected a density in %s", key, unit));
    else if (density > most)
      warn(format("noise model: %s = %.3g %s is implausibly large", key, density, unit));
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
  Eigen::Vector3d::Scalar norms = 0;
  for (const ImuSample& sample : source.imuSamples()) norms += sample.accel.norm();
  info.mean_accel_norm = norms / static_cast<double>(source.imuSamples().size());
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
  Inspector inspector(source, &info);
  inspector.lookAtImages(problems);
  inspector.inspect();
  return info;
}

}  // namespace etalon
