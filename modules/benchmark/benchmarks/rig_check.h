#pragma once

#include <array>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"

namespace etalon {

/** A number of a rig's calibration that images alone determine, in thousandths. */
struct RigParameter {
  std::string name;
  std::string unit;         ///< of error and sigma: mrad, mm, or 1e-3 (relative)
  double correction = 0.0;  ///< value that fits the images best, less the calibration's
  double sigma = 0.0;       ///< its standard error
  /** Keyframes with only this parameter half a thousandth less, and half a thousandth more. */
  std::array<std::vector<SE3>, 2> T_VB_changed;
};

struct RigCheck {
  std::vector<RigParameter> parameters;
  StereoInertialCalibration corrected;  ///< with all corrections
  std::vector<SE3> T_VB;                ///< of the keyframes, the calibration as given
  std::vector<SE3> T_VB_corrected;      ///< with the corrected one
  double rms_px = 0.0;  ///< of a pixel coordinate's residual, the calibration as given
  double rms_px_corrected = 0.0;
};

/**
 * Self-calibration of the rig by bundle adjustment, without IMU and ground truth: rotation of the
 * right camera, direction of the baseline, focal lengths, principal point and radial distortion.
 * The baseline's length is kept, because images do not determine it. The calibration takes one
 * Gauss-Newton step; poses and landmarks are eliminated by solving for them at every changed
 * calibration (variable projection). Standard errors come from the scatter over landmarks, because
 * the errors of a landmark's pixels are correlated. Outliers are those of the given calibration.
 *
 * @param T_VB where the keyframes start from
 */
RigCheck checkRig(const StereoInertialCalibration& calibration,
                  const std::vector<const TrackedFrame*>& keyframes, const std::vector<SE3>& T_VB);

}  // namespace etalon
