#pragma once

/*
 * Least squares on combinations of linear alignment's rows, for methods that eliminate velocities
 * from them.
 *
 * Frames      V the frame of the poses, B_k the body, C_k the left camera at keyframe k.
 * Unknowns    g gravity in V (m/s^2), |g| known; b_a (m/s^2); where they are wanted v_0, the first
 *             velocity (m/s), s, the scale of the left camera's path, and x, the method's own.
 * Residual    T r, r = (r_p, r_v) of all pairs (linear_alignment.h), T the method's own, such that
 *             no velocity but v_0 is left; linear in
 *               r = y - A [v_0 .. v_N-1, g] - by_bias [db_g, db_a] - scale (s - 1) - extra x.
 * Whitening   none, or by the covariance of T r from IMU and poses.
 */

#include <Eigen/Core>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon {

struct CombinedRowsOptions {
  bool weighted = false;  ///< by covariance, with the prior on b_a; needs the estimate's errors
  bool free_scale = false;
  bool first_velocity = false;  ///< v_0 is an unknown; not a key
  int passes = 1;               ///< solutions for gravity's direction and b_a
  double max_condition = 1e4;
  double max_gravity_deviation_mps2 = 1.0;
  double max_sigma_gravity_deg = 10.0;  ///< where the estimate has errors

  /** All but `free_scale`. */
  void declare(ParameterSet& parameters);
  void declareScale(ParameterSet& parameters);
};

/**
 * T of three consecutive keyframes, m s, in which no velocity occurs (Mur-Artal and Tardos, RA-L
 * 2017, eqs. 11 to 13):
 *   dt_k R_k+1 r_p(k+1) - dt_k+1 R_k r_p(k) + dt_k dt_k+1 R_k r_v(k).
 * @return 3(N-2) x 6(N-1)
 */
Eigen::MatrixXd triplesOfPairs(const std::vector<SE3>& T_VB,
                               const std::vector<Preintegration>& preintegrations);

/**
 * T of the positions of keyframes 1.. from the first on, m, in which no velocity but v_0 occurs:
 *   p_k - p_0 - v_0 t_k - g t_k^2 / 2 - alpha_k = sum over j < k of
 *     R_j r_p(j) + (t_k - t_j+1) R_j r_v(j).
 * @return 3(N-1) x 6(N-1)
 */
Eigen::MatrixXd positionsOfPairs(const std::vector<SE3>& T_VB,
                                 const std::vector<Preintegration>& preintegrations);

/** T r of a window at an estimate's poses and biases. */
struct CombinedRows {
  /**
   * @param preintegrations between neighbouring keyframes, at the estimate's b_g
   * @param combination T, a column for each row of the pairs
   * @param extra of r, a row for each row of the pairs; without columns there is no x
   */
  CombinedRows(const InitializationProblem& problem,
               const std::vector<Preintegration>& preintegrations,
               const VisualFrameEstimate& estimate, Eigen::MatrixXd combination,
               Eigen::MatrixXd extra = {});

  std::vector<Preintegration> pairs;
  LinearAlignmentRows rows;  ///< r
  Eigen::MatrixXd T;
  std::vector<Eigen::Vector3d> camera;  ///< p_VC, left
  Eigen::VectorXd pair_scale;           ///< of r
  Eigen::MatrixXd pair_extra;           ///< of r
  /** Of T r: columns of v_0, g, b_a, x and the scale. */
  Eigen::MatrixXd first_velocity, gravity, accel, extra;
  Eigen::VectorXd scale, y;
};

/** The method's own unknowns. */
struct CombinedExtra {
  Eigen::VectorXd x;
  Eigen::MatrixXd errors;  ///< of x by ErrorSources; empty where the estimate has none
};

/**
 * First gravity with its magnitude free and b_a the mean of its prior; then its direction and b_a
 * together, linearised `passes` times. Fills the estimate: gravity, b_a, velocities, and with a
 * free scale positions and landmarks; and adds their errors where it has those of the biases.
 * @return refused: ill_conditioned, implausible, and the estimate is then meaningless
 */
Expected<CombinedExtra> solveCombinedRows(const InitializationProblem& problem,
                                          const CombinedRows& rows,
                                          const CombinedRowsOptions& options,
                                          VisualFrameEstimate* estimate);

/**
 * Velocities: from `first` on by the IMU, r_v = 0; without it those at which the positions of the
 * pairs fit, r_p(k) = 0, and only the last one by r_v = 0. Gravity, b_a and poses are the
 * estimate's.
 */
void solveVelocities(const std::vector<Preintegration>& pairs, const Eigen::Vector3d* first,
                     VisualFrameEstimate* estimate);

/** Errors of a solution, 3 rows each; those that are empty are exact, or not part of it. */
struct CombinedErrors {
  Eigen::MatrixXd accel, gravity, first_velocity;
  Eigen::MatrixXd scale;  ///< one row
  Eigen::MatrixXd extra;  ///< a row for each component
};

/** Sets the errors of [b_a, g_V, velocities of solveVelocities()] behind those of b_g, and adds the
 * scale's to those of the poses, which the rows stand on. */
void addErrors(const CombinedRows& rows, const std::vector<SE3>& T_VB,
               const CombinedErrors& solution, StateErrors* errors);

/** Moves positions and landmarks: the path of the left camera becomes `factor` times as long. */
void rescale(double factor, const std::vector<Eigen::Vector3d>& camera,
             VisualFrameEstimate* estimate);

}  // namespace etalon
