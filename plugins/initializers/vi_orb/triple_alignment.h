#pragma once

/*
 * Gravity, b_a and, where it is free, the scale from three consecutive keyframes at a time, without
 * velocities; then the velocities.
 *
 * Frames      V the frame of the poses, B_k the body, C_k the left camera at keyframe k.
 * Unknowns    g gravity in V (m/s^2), |g| known; b_a (m/s^2); s the scale of the cameras' path.
 * Residual    per triple (k, k+1, k+2), 3 x 1, m s: with the rows r_p, r_v of linear alignment
 *               dt_k R_k+1 r_p(k+1) - dt_k+1 R_k r_p(k) + dt_k dt_k+1 R_k r_v(k),
 *             from which the velocities drop out; linear in g, b_a and s.
 * Whitening   none (as published), or by the covariance of IMU and stereo odometry.
 * Reference   Mur-Artal and Tardos, RA-L 2017, eqs. (11) to (19).
 */

#include <Eigen/Core>
#include <vector>

#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon::plugins {

struct TripleAlignmentOptions {
  bool weighted = false;  ///< by covariance, with the prior on b_a; needs the estimate's errors
  bool free_scale = false;
  int passes = 1;  ///< solutions for gravity's direction and b_a
  double max_condition = 1e4;
  double max_gravity_deviation_mps2 = 1.0;
};

/**
 * Fills gravity, b_a, velocities and, with a free scale, moves positions and landmarks; adds their
 * errors where the estimate has those of the biases.
 * @param preintegrations between neighbouring keyframes, at the estimate's biases
 * @param estimate poses and biases, b_a at the mean of its prior
 * @return refused: ill_conditioned, implausible; the estimate is then meaningless
 */
Expected<void> alignTriples(const InitializationProblem& problem,
                            const std::vector<Preintegration>& preintegrations,
                            const TripleAlignmentOptions& options, VisualFrameEstimate* estimate);

}  // namespace etalon::plugins
