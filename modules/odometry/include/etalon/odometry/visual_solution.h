#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/refusal.h"
#include "etalon/core/se3.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/odometry/stereo_odometry.h"

namespace etalon {

/**
 * What stereo odometry knows of a window of keyframes, in its own frame V (not aligned with
 * gravity).
 */
struct VisualSolution {
  std::vector<SE3> T_VB;                            ///< one a keyframe; the first is the gauge
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_V, m; at most kFarthestLandmark away
  /**
   * Joint covariance of the poses of keyframes 1.. (the first is fixed): 6(N-1) x 6(N-1), blocks
   * [rotation, position], right perturbation of the rotation (rad), additive position in V (m).
   * Empty where it was not computed.
   */
  Eigen::MatrixXd covariance;
  double rms_px =
      0.0;  ///< root mean square of the inliers' reprojection residuals, per pixel coordinate
  int inliers = 0, outliers = 0;  ///< observations
};

/**
 * Stereo odometry over a window, from its tracks alone: PnP from keyframe to keyframe, then bundle
 * adjustment to convergence, with covariance.
 * @param R_prev_cur rotation of the body between neighbouring keyframes, from which PnP starts: one
 *        fewer than keyframes
 * @return refused if a keyframe cannot be located
 */
Expected<VisualSolution> solveStereoOdometry(const StereoInertialCalibration& calibration,
                                             const std::vector<const TrackedFrame*>& keyframes,
                                             const std::vector<Eigen::Matrix3d>& R_prev_cur,
                                             const StereoOdometryOptions& options);

}  // namespace etalon
