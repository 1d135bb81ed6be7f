#pragma once

/*
 * Preintegration residual: two body states against the IMU measured between them.
 *
 * Frames      W world (or V), B_i and B_j the body at the two ends of the interval.
 * Parameters  T_WBi, T_WBj poses (6 each: rotation by right perturbation R Exp(d), position
 *             additive in W), v_i, v_j velocities in W (3 each, m/s), b_g (3, rad/s) and
 *             b_a (3, m/s^2) constant over the interval, g_W gravity (3, m/s^2).
 * Residual    9 x 1, order [rotation (rad), position (m), velocity (m/s)], dt the interval:
 *               r_R = Log(dR(b_g)^T R_WBi^T R_WBj)
 *               r_p = R_WBi^T (p_j - p_i - v_i dt - g_W dt^2 / 2) - dp(b_g, b_a)
 *               r_v = R_WBi^T (v_j - v_i - g_W dt) - dv(b_g, b_a)
 *             with the deltas corrected to the biases to first order (Preintegration::corrected).
 * Whitening   the caller's: sqrtInformation() gives L with L^T L = covariance9^-1, by which the first
 *             three rows are the rotation's alone, that is the gyro's, and the others are position
 *             and velocity given the rotation.
 * Jacobians   right perturbation of the rotations; everything else additive. They are exact for
 *             this residual, also far from the solution; r_R is singular at an angle of pi.
 * Leaves out  the bias random walk between keyframes (part of covariance9), robust loss (the
 *             caller's).
 * Reference   Forster et al., On-Manifold Preintegration, TRO 2017, eqs. (37), (38), (44), (45).
 */

#include <Eigen/Core>

#include "etalon/core/se3.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

/** Derivatives of the residual, rows as in the residual. */
struct PreintegrationJacobians {
  Eigen::Matrix<double, 9, 6> pose_i, pose_j;  ///< columns [rotation, position]
  Eigen::Matrix<double, 9, 3> velocity_i, velocity_j;
  Eigen::Matrix<double, 9, 3> bias_gyro, bias_accel;
  Eigen::Matrix<double, 9, 3> gravity;
};

/** @param J receives all derivatives if not null */
Eigen::Matrix<double, 9, 1> preintegrationResidual(const Preintegration& preintegration,
                                                   const SE3& T_WBi, const Eigen::Vector3d& v_i,
                                                   const SE3& T_WBj, const Eigen::Vector3d& v_j,
                                                   const ImuBias& bias, const Eigen::Vector3d& g_W,
                                                   PreintegrationJacobians* J = nullptr);

/**
 * L, lower triangular, with L^T L the inverse of Preintegration::covariance9().
 * @throws DataError if that is not positive definite (a default-constructed preintegration, or
 *         noise densities that are zero or not finite)
 */
Eigen::Matrix<double, 9, 9> sqrtInformation(const Preintegration& preintegration);

}  // namespace etalon
