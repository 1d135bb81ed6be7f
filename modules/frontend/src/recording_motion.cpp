#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"
#include "etalon/frontend/time_offset.h"

namespace etalon {

namespace {

/** Well above the 2 to 3 deg that a few seconds of motion leave open. */
constexpr double kMaxRotationErrorDeg = 20.0;

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

/** Gyro and camera turn, but not alike: neither units nor extrinsics nor a time offset do that.
 */
void checkCorrelation(const TimeOffsetEstimate& offset, Sentences* warnings) {
  if (!offset.estimated || offset.correlation >= kPoorCorrelation ||
      offset.gyro_spread_rad < kTurningRad)
    return;
  const bool mirrored = offset.correlation_mirrored > offset.correlation + 0.1;
  warnings->push_back(format(
      "IMU: the gyro turns, but not as the images do (correlation %.3f); %s", offset.correlation,
      mirrored ? format("with one axis of the gyro inverted it is %.3f: is a sign wrong?",
                        offset.correlation_mirrored)
                     .c_str()
               : "are axes exchanged or scaled, or do the streams belong together?"));
}

void checkClocks(const TimeOffsetEstimate& offset, double image_rate_hz, Sentences* warnings) {
  const double half_period = image_rate_hz > 0 ? 0.5 / image_rate_hz : 0.025;
  if (offset.discernible() && std::abs(offset.offset_s) > half_period)
    warnings->push_back(
        format("time offset: the images show the gyro's motion of %.1f ms %s (correlation %.3f, "
               "%.3f without offset); are the clocks synchronised?",
               1e3 * std::abs(offset.offset_s), offset.offset_s > 0 ? "later" : "earlier",
               offset.correlation, offset.correlation_at_zero));
}

}  // namespace

std::optional<double> rotationDisagreementDeg(const TimeOffsetEstimate& offset,
                                              const StereoInertialCalibration& calibration) {
  if (!offset.clear || !offset.R_CB) return std::nullopt;
  return degrees(logSO3(*offset.R_CB * calibration.cameras[0].T_BC.R).norm());
}

RecordingFindings checkMotion(const TimeOffsetEstimate& offset,
                              const StereoInertialCalibration& calibration, double image_rate_hz) {
  RecordingFindings findings;
  const std::optional<double> angle_deg = rotationDisagreementDeg(offset, calibration);
  if (angle_deg && *angle_deg > kMaxRotationErrorDeg)
    findings.warnings.push_back(
        format("extrinsics: the rotation of cam0 to the IMU differs by %.0f deg from what gyro and "
               "images say; is T_BS sensor to body?",
               *angle_deg));
  checkGyro(offset, &findings.warnings);
  checkCorrelation(offset, &findings.warnings);
  checkClocks(offset, image_rate_hz, &findings.warnings);
  return findings;
}

}  // namespace etalon
