#pragma once

/*
 * Gyro bias and the rotation between camera and IMU together.
 *
 * Frames      B_k the body, C_k the left camera at keyframe k.
 * Unknowns    b_g (rad/s) and R_BC, moved by Exp(phi) from the left (rad).
 * Residual    per pair of neighbours, 3 x 1, rad: Log(dR_k(b_g)^T R_BC R_CkCk+1 R_BC^T), linear in
 *             both: r_k = J_k db_g - (R_BkBk+1^T - 1) phi.
 * Whitening   none (as published), or by the covariance of IMU and stereo odometry.
 * Start       R_BC from quaternions by singular values, q(dR_k) q_BC = q_BC q(R_CkCk+1), b_g the
 *             mean of its prior.
 * Reference   Huang, Liu and Wan, T-RO 2020; the start is that of Yang and Shen, T-ASE 2017.
 */

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/gravity_alignment.h"

namespace etalon::plugins {

struct HandEye {
  Eigen::Matrix3d R_BC = Eigen::Matrix3d::Identity();
  ImuBias bias;                                 ///< b_a the mean of its prior
  std::vector<Preintegration> preintegrations;  ///< at `bias`
  /** Standard deviation of R_BC about its weakest axis, rad, from the residuals' own size. */
  double sigma_rotation = 0.0;
  std::optional<StateErrors> errors;  ///< of the biases, if stereo odometry has a covariance
  Eigen::MatrixXd rotation_errors;    ///< of R_BC: phi, 3 rows by the errors' sources
};

/**
 * @param passes Gauss-Newton steps, at most, each followed by integrating the raw IMU anew
 * @return nothing if the rotations do not determine both
 */
std::optional<HandEye> solveHandEye(const InitializationProblem& problem,
                                    const VisualSolution& visual, bool weighted, int passes);

}  // namespace etalon::plugins
