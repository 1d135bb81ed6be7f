#pragma once

/*
 * Linear alignment: velocities and gravity from fixed poses, fixed biases and the scale of a stereo
 * camera.
 *
 * Frames      V the frame of the poses, B_k the body at keyframe k.
 * Unknowns    v_k velocity in V at every keyframe (m/s), g gravity in V (m/s^2), |g| known.
 * Residual    per pair of neighbours, 6 x 1, linear in the unknowns, dt the interval:
 *               r_p = R_VBk^T (p_k+1 - p_k - v_k dt - g dt^2 / 2) - dp(b_g, b_a)
 *               r_v = R_VBk^T (v_k+1 - v_k - g dt) - dv(b_g, b_a)
 * Whitening   none (as published), by the preintegration's covariance of (dp, dv), or by that and
 *             the covariance of the poses.
 * Reference   Qin, Li and Shen, VINS-Mono, TRO 2018, section V-B2 and V-B3, with scale 1.
 */

#include <Eigen/Core>
#include <vector>

#include "etalon/core/refusal.h"
#include "etalon/core/se3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

struct LinearAlignmentOptions {
  double gravity_mps2 = 9.81;
  bool weighted = true;  ///< by the preintegration's covariance; false: rows as they are
  /**
   * Covariance of the poses of keyframes 1.., 6(N-1) x 6(N-1), as VisualSolution::covariance; added
   * to the preintegration's (needs `weighted`). Empty: the poses are taken as exact.
   */
  Eigen::MatrixXd pose_covariance;
  /** Iterations in the tangent plane of gravity's sphere (VINS-Mono: 4); 0: the exact minimum on
   * the sphere. */
  int tangent_iterations = 4;
};

/** What a linear re-estimation of velocities and gravity returns. */
struct LinearAlignmentResult {
  SolverSummary summary;  ///< singular: velocities or gravity are not determined
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> v_VB;
  /** Norm of gravity where it is left free, m/s^2: far from the true one, the poses or biases are
   * wrong. */
  double free_gravity_mps2 = 0.0;
};

/**
 * The seed of the tangent-plane iterations is the solution with gravity left free.
 * @param T_VB poses of N keyframes; with fewer than three the alignment is singular
 * @param preintegrations N-1, between neighbours
 */
LinearAlignmentResult alignLinearly(const std::vector<SE3>& T_VB,
                                    const std::vector<Preintegration>& preintegrations,
                                    const ImuBias& bias, const LinearAlignmentOptions& options);

/**
 * The same, weighted by the preintegration's covariance, poses exact, gravity refined from
 * `g_seed`.
 */
LinearAlignmentResult alignVelocitiesAndGravity(const std::vector<SE3>& T_VB,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias, double gravity_mps2,
                                                const Eigen::Vector3d& g_seed);

/** Refused (implausible) where gravity, its magnitude left free, is farther from its magnitude than
 * allowed, m/s^2. */
Expected<void> checkFreeGravity(double free_mps2, double gravity_mps2, double max_deviation_mps2);

/** (r_p, r_v) of all pairs, unwhitened: r = y - A [v_0 .. v_N-1, g_V], and how they answer to what
 * goes in, to first order. */
struct LinearAlignmentRows {
  Eigen::MatrixXd A;         ///< 6(N-1) x (3N + 3)
  Eigen::VectorXd y;         ///< 6(N-1)
  Eigen::MatrixXd by_poses;  ///< 6(N-1) x 6(N-1), [rotation, position] of keyframes 1..
  Eigen::MatrixXd by_bias;   ///< 6(N-1) x 6, of dp and dv: the rows change by minus that
};

LinearAlignmentRows linearAlignmentRows(const std::vector<SE3>& T_VB,
                                        const std::vector<Preintegration>& preintegrations,
                                        const ImuBias& bias);

/** How the solution [v_0 .. v_N-1, g_V] answers to the rows, to first order. Empty where it is not
 * determined. */
struct LinearAlignmentResponse {
  Eigen::MatrixXd by_rows;  ///< (3N + 3) x 6(N-1)
  LinearAlignmentRows rows;
};

/** At the solution `g_V` that alignLinearly() returned for the same arguments. */
LinearAlignmentResponse linearAlignmentResponse(const std::vector<SE3>& T_VB,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias,
                                                const LinearAlignmentOptions& options,
                                                const Eigen::Vector3d& g_V);

}  // namespace etalon
