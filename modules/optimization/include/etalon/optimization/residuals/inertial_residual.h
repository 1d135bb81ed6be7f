#pragma once

/*
 * Inertial residual of odometry: two states, each with biases of its own, against the IMU measured
 * between them.
 *
 * Frames      as in preintegration_residual.h.
 * Parameters  two NavState, 15 each in the order of state_index: rotation by right perturbation
 *             R Exp(d), everything else additive (position and velocity in W).
 * Residual    15 x 1, order of state_index: that of preintegrationResidual() at the biases of the
 *             first state, then b_g,j - b_g,i (rad/s) and b_a,j - b_a,i (m/s^2).
 * Whitening   the caller's: inertialSqrtInformation() gives L with L^T L the inverse of
 *             Preintegration::covariance(), which has the biases' walk, what it does to the motion
 *             within the interval, and the correlation of the two. Nothing is counted twice.
 * Reference   Forster et al., On-Manifold Preintegration, TRO 2017; the joint covariance as in
 *             GTSAM's CombinedImuFactor.
 */

#include "etalon/optimization/residuals/preintegration_residual.h"

namespace etalon {

/** @param J_i,J_j receive the derivatives, 15 x 15, if not null */
Eigen::Matrix<double, 15, 1> inertialResidual(const Preintegration& preintegration,
                                              const NavState& state_i, const NavState& state_j,
                                              const Eigen::Vector3d& g_W,
                                              Eigen::Matrix<double, 15, 15>* J_i = nullptr,
                                              Eigen::Matrix<double, 15, 15>* J_j = nullptr);

/**
 * L, upper triangular, with L^T L the inverse of Preintegration::covariance().
 * @throws DataError if that is not positive definite (no samples, or a density of zero)
 */
Eigen::Matrix<double, 15, 15> inertialSqrtInformation(const Preintegration& preintegration);

}  // namespace etalon
