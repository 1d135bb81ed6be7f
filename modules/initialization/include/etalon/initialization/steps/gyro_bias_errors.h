#pragma once

#include <Eigen/Core>
#include <vector>

namespace etalon {

/** First-order errors of a gyro bias that an earlier step has found, for the steps that use it. */
struct GyroBiasErrors {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of what is not the IMU's, (rad/s)^2
  /** By the rotation error (right perturbation, rad) of every preintegration between neighbouring
   * keyframes, 1/s; empty: by none. */
  std::vector<Eigen::Matrix3d> by_rotations;
};

}  // namespace etalon
