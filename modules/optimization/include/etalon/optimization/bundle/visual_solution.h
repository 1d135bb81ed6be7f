#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/core/tracked_frame.h"

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

}  // namespace etalon
