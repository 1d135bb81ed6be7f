#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/imu/imu_sample.h"
#include "etalon/initialization/initialization_result.h"

namespace etalon {

/** What an estimate is compared with in the order of Initialization::covariance. */
struct WindowTruth {
  Eigen::Matrix3d R_WB0 = Eigen::Matrix3d::Identity();  ///< attitude at the first keyframe
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();       ///< of the last keyframe, m/s
  ImuBias bias;
};

/**
 * Estimate less truth in the order of Initialization::covariance: b_g (rad/s), b_a (m/s^2),
 * tilt (rad), v_WB of the last keyframe (m/s).
 *
 * The yaw of the world cannot be observed: the true world is turned about its z until the first
 * keyframe's attitudes differ by a horizontal rotation alone, R_WB0 = Exp((tilt_x, tilt_y, 0))
 * R_WB0_true; velocities are compared in that world.
 * @param states one a keyframe, not empty
 */
Eigen::Matrix<double, 11, 1> estimationError(const std::vector<StampedState>& states,
                                             const ImuBias& bias, const WindowTruth& truth);

/**
 * Errors of the poses relative to the first keyframe, T_B0Bk, in the order of
 * Initialization::covariance: rotation (right perturbation, rad) and position (m, in B0) of
 * each keyframe but the first.
 * @param truth as many states, in any world
 */
Eigen::VectorXd relativePoseErrors(const std::vector<StampedState>& states,
                                   const std::vector<StampedState>& truth);

/**
 * Initialization::covariance of an estimate that is known to be off, from a better one of the same
 * window with a covariance P of its own. With d the first less the second the error is d and that
 * of the better one. If that has no mean given d, the mean square is d d^T + P: so it is where the
 * better one leaves little unused of what the window says, or d is far larger than its errors.
 * @return of the size of P; empty if the better one has none
 */
Eigen::MatrixXd covarianceAround(const Initialization& better, const Initialization& estimate);

}  // namespace etalon
