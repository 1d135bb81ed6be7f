#pragma once

/*
 * Gyro bias of rotations: b_g that makes the preintegrated rotations those of stereo odometry.
 *
 * Frames      V the frame of the poses, B_k the body at keyframe k.
 * Unknown     b_g, rad/s.
 * Residual    per pair of neighbours, 3 x 1, rad: r_k = 2 vec(q) of dR_k(b_g)^T R_VBk^T R_VBk+1,
 *             linear in the change of b_g: r_k = J_k db_g, J_k = dR_dbg of the preintegration.
 * Whitening   none, by the IMU's rotations, or by these and stereo odometry's.
 * Reference   Qin, Li and Shen, VINS-Mono, TRO 2018, section V-B1; Mur-Artal and Tardos, RA-L 2017,
 *             eq. (9), has the logarithm for 2 vec(q), which is the same at the solution.
 */

#include <Eigen/Core>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/gravity_alignment.h"

namespace etalon {

/** What the rows of a linear step are whitened by. */
enum class RowWeights { kNone, kImu, kImuAndVision };

struct RotationBias {
  ImuBias bias;                                 ///< b_a is that of the start
  std::vector<Preintegration> preintegrations;  ///< at `bias`
  Eigen::MatrixXd response;                     ///< db_g/dr, 3 x 3(N-1)

  /**
   * Poses, landmarks and biases, b_a the mean of its prior; with the biases' errors if stereo
   * odometry has a covariance. Gravity and velocities are for the caller to add.
   */
  VisualFrameEstimate estimate(const InitializationProblem& problem,
                               const VisualSolution& visual) const;
};

/** Covariance of stereo odometry's rotations from keyframe to keyframe, right perturbations, rad:
 * 3(N-1) x 3(N-1); zero where it has none. */
Eigen::MatrixXd covarianceOfRotations(const VisualSolution& visual);

/**
 * Linear least squares from the mean of the priors; the raw IMU is integrated anew at each result,
 * because a linear step leaves an error of the order of (|db_g| dt)^2 / dt.
 * @param passes linear solutions, at most
 * @return refused (ill_conditioned) if the rotations do not determine b_g
 */
Expected<RotationBias> gyroBiasOfRotations(const InitializationProblem& problem,
                                           const VisualSolution& visual, RowWeights weights,
                                           int passes);

}  // namespace etalon
