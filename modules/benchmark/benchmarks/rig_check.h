#pragma once

#include <array>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"

namespace etalon {

/** A number of a rig's calibration that images alone can tell, in thousandths. */
struct RigParameter {
  std::string name;
  std::string unit;         ///< of error and sigma: mrad, mm, or 1e-3 (relative)
  double correction = 0.0;  ///< what the images want, less what the calibration says
  double sigma = 0.0;       ///< its standard error
  /** Keyframes with the parameter alone half a thousandth less and half a thousandth more. */
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
 * The baseline's length stays as it is: images do not tell it. One Gauss-Newton step on the
 * calibration alone, poses and landmarks eliminated by solving for them anew at every changed
 * calibration (variable projection); standard errors from the scatter over landmarks, whose pixels
 * err alike from keyframe to keyframe. Outliers are those of the calibration as given.
 *
 * @param T_VB where the keyframes start from
 */
RigCheck checkRig(const StereoInertialCalibration& calibration,
                  const std::vector<const TrackedFrame*>& keyframes, const std::vector<SE3>& T_VB);

}  // namespace etalon
