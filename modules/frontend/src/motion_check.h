#pragma once

// Which tracks agree with one rigid motion of the camera. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "etalon/core/camera_model.h"

namespace etalon {

/** Whether the ray meets the plane z = 1 where that is of use: within 70 degrees of the axis. */
inline bool meetsPlane(const Eigen::Vector3d& ray) {
  constexpr double kLeastCosine = 0.34;
  return ray.z() > kLeastCosine * ray.norm();
}

/** A track between two frames of one camera. */
struct TrackedRay {
  Eigen::Vector3d before = Eigen::Vector3d::UnitZ();  ///< CameraModel::unproject
  MeasuredDirection now;
  double inverse_depth =
      -1.0;  ///< 1/m, of the landmark before / inverse_depth; negative if unknown
};

/**
 * One flag a ray: whether it agrees with the camera's motion within `threshold_px`.
 *
 * Where enough depths are known, the motion minimises the robust reprojection error of those
 * landmarks (Gauss-Newton from `R_now_before` and no translation, Cauchy loss whose scale is halved
 * down to the threshold); a landmark of known depth must be where the motion takes it, another one
 * on its epipolar line. Else a fundamental matrix judges (RANSAC, fixed seed) those that
 * meetsPlane(), and with fewer than 20 of them nothing does.
 *
 * @param R_now_before rotation of the camera as the gyro saw it
 * @param focal_px pixels a radian
 */
std::vector<char> agreeWithMotion(const std::vector<TrackedRay>& rays,
                                  const Eigen::Matrix3d& R_now_before, double focal_px,
                                  double threshold_px);

}  // namespace etalon
