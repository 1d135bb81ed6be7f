#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"
#include "etalon/frontend/time_offset.h"

namespace etalon {

namespace {

/** Of the camera's rotations, the part that a wrong calibration leaves unexplained over the one that
 * another leaves. Right ones stay below 1.06, images of a few seconds included. */
constexpr double kExplainsMore = 1.3;
/** Correlations above sqrt(1 - kAlike) are alike. */
constexpr double kAlike = 1e-3;

/** Real motion tracked in real images lies above 0.9. */
constexpr double kPoorCorrelation = 0.8;
/** Spread of the gyro's rotations from image to image that images are sure to show: vision errs by
 * 1 to 3 mrad. */
constexpr double kTurningRad = 6e-3;

using Sentences = std::vector<std::string>;

void checkGyro(const TimeOffsetEstimate& offset, Sentences* warnings) {
  if (offset.clear && offset.gyro_scale > 30 && offset.gyro_scale < 110)
    warnings->push_back(
        format("IMU: the gyro's rates are %.1f times the camera's; the gyro seems to be in "
               "deg/s, expected rad/s",
               offset.gyro_scale));
  else if (offset.clear && (offset.gyro_scale < 0.6 || offset.gyro_scale > 1.6))
    warnings->push_back(
        format("IMU: the gyro's rates are %.3f times the camera's; expected 1", offset.gyro_scale));
}

/** Whether the second correlation leaves much less of the camera's rotations unexplained. */
bool explainsMore(double correlation, double other) {
  const auto unexplained = [](double c) { return 1.0 - c * std::max(0.0, c) + kAlike; };
  return unexplained(correlation) > kExplainsMore * unexplained(other);
}

/** Whether gyro and camera turn alike; as the calibration has the camera in the body, or otherwise. */
void checkRotations(const TimeOffsetEstimate& offset, const std::optional<double>& angle_deg,
                    Sentences* warnings) {
  if (!offset.estimated || offset.gyro_spread_rad < kTurningRad) return;
  if (std::max(offset.correlation, offset.correlation_mirrored) < kPoorCorrelation)
    warnings->push_back(format(
        "IMU: the gyro turns, but not as the images do (correlation %.3f); are axes exchanged "
        "or scaled, or do the streams belong together?",
        offset.correlation));
  else if (explainsMore(offset.correlation, offset.correlation_mirrored))
    warnings->push_back(
        format("IMU: the gyro turns as the images do only with one axis or all three inverted "
               "(correlation %.3f, at most %.3f without); is a sign wrong?",
               offset.correlation_mirrored, offset.correlation));
  else if (explainsMore(offset.correlation_as_given, offset.correlation))
    warnings->push_back(
        "extrinsics: the rotation of cam0 to the IMU " +
        (angle_deg ? format("differs by %.0f deg from", *angle_deg) : "is not") +
        format(" what gyro and images say (correlation %.3f, with the given one %.3f); is T_BS "
               "sensor to body?",
               offset.correlation, offset.correlation_as_given));
}

void checkClocks(const TimeOffsetEstimate& offset, double image_rate_hz, Sentences* warnings) {
  const double half_period = image_rate_hz > 0 ? 0.5 / image_rate_hz : 0.025;
  if (offset.discernible() && std::abs(offset.offset_s) > half_period)
    warnings->push_back(
        format("time offset: the images show the gyro's motion of %.1f ms %s (correlation %.3f, "
               "%.3f without offset); are the clocks synchronised? timeshift_cam_imu: %.4f in a "
               "camchain.yaml (--camchain) shifts the stamps",
               1e3 * std::abs(offset.offset_s), offset.offset_s > 0 ? "later" : "earlier",
               offset.correlation, offset.correlation_at_zero, offset.offset_s));
}

}  // namespace

std::optional<double> rotationDisagreementDeg(const TimeOffsetEstimate& offset,
                                              const StereoInertialCalibration& calibration) {
  if (!offset.estimated || offset.correlation < kPoorCorrelation || !offset.R_CB)
    return std::nullopt;
  return degrees(logSO3(*offset.R_CB * calibration.cameras[0].T_BC.R).norm());
}

RecordingFindings checkMotion(const TimeOffsetEstimate& offset,
                              const StereoInertialCalibration& calibration, double image_rate_hz) {
  RecordingFindings findings;
  checkGyro(offset, &findings.warnings);
  checkRotations(offset, rotationDisagreementDeg(offset, calibration), &findings.warnings);
  checkClocks(offset, image_rate_hz, &findings.warnings);
  return findings;
}

}  // namespace etalon
