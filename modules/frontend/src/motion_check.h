#pragma once

// Which tracks agree with one rigid motion of the camera. Private to the module.

#include <Eigen/Core>
#include <vector>

namespace etalon {

/** A track between two frames of one camera: undistorted, normalised coordinates. */
struct TrackedRay {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  Eigen::Vector2d now = Eigen::Vector2d::Zero();
  double inverse_depth = -1.0;  ///< 1/m in the frame before; negative if unknown
};

/**
 * One flag a ray: whether it agrees with the camera's motion within `threshold_px`.
 *
 * Where enough depths are known, the motion minimises the robust reprojection error of those
 * landmarks (Gauss-Newton from `R_now_before` and no translation, Cauchy loss whose scale is halved
 * down to the threshold); a landmark of known depth must be where the motion takes it, another one
 * on its epipolar line. Else a fundamental matrix judges (RANSAC, fixed seed), and with fewer than
 * 20 rays nothing does.
 *
 * @param R_now_before rotation of the camera as the gyro saw it
 * @param focal_px pixels a unit of normalised coordinates
 */
std::vector<char> agreeWithMotion(const std::vector<TrackedRay>& rays,
                                  const Eigen::Matrix3d& R_now_before, double focal_px,
                                  double threshold_px);

}  // namespace etalon
