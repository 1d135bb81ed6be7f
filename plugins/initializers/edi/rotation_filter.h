#pragma once

/*
 * Error-state Kalman filter of attitude and gyro bias.
 *
 * Frames      V the frame of stereo odometry, B_k the body at keyframe k.
 * State       R_VBk and b_g; error [theta, db_g] (rad, rad/s), R_true = R Exp(theta).
 * Prediction  by the gyro from keyframe to keyframe, theta' = dR^T theta + J db_g + noise with J =
 *             dR_dbg of the preintegration, noise that of its rotation; b_g walks.
 * Update      with the attitude of stereo odometry, z = Log(R^T R_vision) = theta + noise, of that
 *             keyframe's own covariance.
 * Left out    what the attitudes of stereo odometry have in common.
 * Reference   Wang et al., EDI, IROS 2023.
 */

#include <Eigen/Core>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/gravity_alignment.h"

namespace etalon::plugins {

struct FilteredRotations {
  VisualFrameEstimate estimate;  ///< attitudes after each update, positions of stereo odometry
  std::vector<Preintegration> preintegrations;  ///< at its b_g
};

/**
 * The error is linear around a trajectory that the gyro integrates from the first attitude; the
 * filter runs again around what it has found until b_g stands still, at most `passes` times.
 * @param sigma_rad noise of an attitude an axis where stereo odometry has no covariance
 */
FilteredRotations filterRotations(const InitializationProblem& problem,
                                  const VisualSolution& visual, int passes, double sigma_rad);

}  // namespace etalon::plugins
