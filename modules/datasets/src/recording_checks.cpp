#include "etalon/datasets/recording_checks.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/imu/imu_limits.h"
#include "etalon/imu/imu_noise.h"
#include "stamped_rows.h"

namespace etalon {

namespace {

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

/** The checks of the noise model in the IMU's sensor.yaml. */
class NoiseModelCheck {
 public:
  NoiseModelCheck(const RecordedSource& source, RecordingFindings* findings)
      : file_(source.calibrationFile("imu0") + ": noise model: "),
        imu_(source.imuMeasurements()),
        rate_hz_(measuredRate(imu_)),
        findings_(*findings) {}

  /** @param usual one of MEMS sensors in public use */
  void density(const char* key, double density, double least, double most, double usual,
               const char* unit, Eigen::Vector3d ImuSample::*channel) {
    const double measured = quietestNoise(imu_, rate_hz_, channel);
    const double sigma = density * std::sqrt(rate_hz_);
    if (density <= 0)
      findings_.errors.push_back(
          file_ + format("%s is zero, so the IMU would count for everything; expected a "
                         "continuous-time density in %s: that of the data sheet, or a usual one "
                         "as %.1e",
                         key, unit, usual));
    else if (density < least)
      warn(format("%s = %.3g %s is implausibly small", key, density, unit));
    else if (density > most)
      warn(
          format("%s = %.3g %s is implausibly large; is it a discrete-time sigma? expected a "
                 "continuous-time density (sigma divided by sqrt(rate))",
                 key, density, unit));
    else if (measured > 0 && sigma > 8 * measured)
      warn(
          format("%s = %.3g %s means a sigma of %.3g a sample, the quietest half second has %.3g; "
                 "is it a discrete-time sigma?",
                 key, density, unit, sigma, measured));
  }

  void walk(const char* key, double density, double least, double most, const char* unit) {
    if (density < least)
      warn(format("%s = %.3g %s is implausibly small; %.0e is used", key, density, unit, least));
    else if (density > most)
      warn(format("%s = %.3g %s is implausibly large", key, density, unit));
  }

 private:
  void warn(const std::string& sentence) { findings_.warnings.push_back(file_ + sentence); }

  std::string file_;
  std::vector<ImuSample> imu_;
  double rate_hz_;
  RecordingFindings& findings_;
};

void checkBaseline(const RecordedSource& source, RecordingFindings* findings) {
  const double baseline = source.calibration().baseline();
  const std::string where = source.calibrationFile("cam1") + ": extrinsics: ";
  // Rigs in use have 0.04 to 1 m; of those in millimetres the shortest reads 40.
  if (baseline < 1e-4)
    findings->errors.push_back(
        where +
        format("the two cameras stand in the same place (baseline %.3g m), so no depth can "
               "be seen; expected T_BS of cam0 and cam1 to differ by the baseline in metres",
               baseline));
  else if (baseline > 20.0)
    findings->errors.push_back(
        where +
        format("a stereo baseline of %.4g m; expected T_BS in metres, are they millimetres? "
               "then divide its last column by 1000",
               baseline));
  else if (baseline < 5e-3 || baseline > 5.0)
    findings->warnings.push_back(
        where + format("a stereo baseline of %.4g m is unlikely; is T_BS in metres?", baseline));
}

void checkImageSizes(const RecordedSource& source, RecordingFindings* findings) {
  const CameraModel &left = source.calibration().cameras[0].model,
                    &right = source.calibration().cameras[1].model;
  if (left.width() != right.width() || left.height() != right.height())
    findings->errors.push_back(
        source.calibrationFile("cam1") +
        format(": resolution: %dx%d pixels, and %dx%d of cam0; expected two cameras of one size",
               right.width(), right.height(), left.width(), left.height()));
}

}  // namespace

void RecordingFindings::append(const RecordingFindings& other) {
  errors.insert(errors.end(), other.errors.begin(), other.errors.end());
  warnings.insert(warnings.end(), other.warnings.begin(), other.warnings.end());
}

RecordingFindings checkCalibration(const RecordedSource& source) {
  RecordingFindings findings;
  checkImageSizes(source, &findings);
  checkBaseline(source, &findings);
  const ImuNoiseDensities& noise = source.calibration().imu.noise;
  // Continuous-time densities of MEMS sensors lie between 1e-5 and 1e-3 rad/s/sqrt(Hz), 1e-4 and
  // 1e-2 m/s^2/sqrt(Hz); a discrete-time sigma at 200 Hz is 14 times its density.
  NoiseModelCheck check(source, &findings);
  check.density("gyroscope_noise_density", noise.gyro_noise_density, 1e-6, 2e-3, 1.7e-4,
                "rad/s/sqrt(Hz)", &ImuSample::gyro);
  check.density("accelerometer_noise_density", noise.accel_noise_density, 1e-5, 2e-2, 2.0e-3,
                "m/s^2/sqrt(Hz)", &ImuSample::accel);
  check.walk("gyroscope_random_walk", noise.gyro_random_walk, kLeastGyroRandomWalk, 1e-2,
             "rad/s^2/sqrt(Hz)");
  check.walk("accelerometer_random_walk", noise.accel_random_walk, kLeastAccelRandomWalk, 1e-1,
             "m/s^3/sqrt(Hz)");
  return findings;
}

RecordingFindings checkImu(const RecordedSource& source) {
  RecordingFindings findings;
  const auto warn = [&findings](const std::string& s) { findings.warnings.push_back("IMU: " + s); };
  std::vector<double> rates;
  double accel = 0.0;
  size_t wrong = 0;
  const ImuSample* first_wrong = nullptr;
  for (const ImuSample& sample : source.imuSamples()) {
    if (!isMeasurement(sample)) {
      if (wrong++ == 0) first_wrong = &sample;
      continue;
    }
    rates.push_back(sample.gyro.norm());
    accel += sample.accel.norm();
  }
  if (rates.empty() || wrong > rates.size()) {
    findings.errors.push_back(
        source.name() + format(": %zu of %zu IMU samples are no measurements; expected rad/s below "
                               "%g and m/s^2 below %g",
                               wrong, source.imuSamples().size(), kMostGyroRps, kMostAccelMps2));
    return findings;
  }
  if (first_wrong)
    warn(
        format("%zu of %zu samples are no measurements and are dropped; the first at stamp %lld "
               "has %.3g rad/s and %.3g m/s^2",
               wrong, source.imuSamples().size(), static_cast<long long>(first_wrong->t),
               first_wrong->gyro.norm(), first_wrong->accel.norm()));
  accel /= static_cast<double>(rates.size());
  if (accel > 0.5 && accel < 2.0)
    warn(format("the mean acceleration is %.3f; the accelerometer seems to be in g, expected m/s^2",
                accel));
  else if (accel < 0.5)
    warn(
        format("the mean acceleration is %.3f m/s^2; expected specific force, gravity (9.81) "
               "included",
               accel));
  else if (accel < 7.0 || accel > 13.0)
    warn(format("the mean acceleration is %.3f m/s^2; expected about 9.81", accel));
  const double largest = *std::max_element(rates.begin(), rates.end());
  const double typical = median(std::move(rates));
  // 35 rad/s is the full scale of usual gyros (2000 deg/s); 5 rad/s is more than vision can follow
  // for long.
  if (largest > 35.0 || typical > 5.0)
    warn(
        format("gyro rates of %.3g (median) and %.3g (largest) are unlikely in rad/s; are they in "
               "deg/s?",
               typical, largest));
  return findings;
}

}  // namespace etalon
