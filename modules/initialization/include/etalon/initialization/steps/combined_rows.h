#pragma once

/*
 * Least squares on combinations of linear alignment's rows, for methods that eliminate velocities
 * from them; unknowns are gravity, b_a and the scale of the cameras' path.
 *
 * Frames      V the frame of the poses, B_k the body, C_k the left camera at keyframe k.
 * Residual    T r, r = (r_p, r_v) of all pairs (linear_alignment.h), T the method's own; linear in
 *               r = y - A [v_0 .. v_N-1, g_V] - by_bias [db_g, db_a] - scale ds.
 * Whitening   none, or by the covariance of T r from IMU and stereo odometry.
 */

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon {

/** dz/dy of the least-squares solution of M z = y, by singular values. */
struct LeastSquares {
  Eigen::MatrixXd response;
  double condition = INFINITY;  ///< of M with columns of unit length; infinite: not determined

  explicit LeastSquares(const Eigen::MatrixXd& M);
};

/** T r of a window at an estimate's poses and biases. */
struct CombinedRows {
  /**
   * @param pairs preintegrations between neighbouring keyframes, at the estimate's b_g
   * @param T a column for each row of the pairs
   */
  CombinedRows(const InitializationProblem& problem, const std::vector<Preintegration>& pairs,
               const VisualFrameEstimate& estimate, Eigen::MatrixXd T);

  LinearAlignmentRows rows;  ///< r
  Eigen::MatrixXd T;
  std::vector<Eigen::Vector3d> camera;  ///< p_VC, left
  Eigen::VectorXd pair_scale;           ///< of r
  /** Of T r: columns of v_0, g_V, b_a and the scale. */
  Eigen::MatrixXd first_velocity, gravity, accel;
  Eigen::VectorXd scale, y;

  /** Errors of T r; 6 rows of `bias_errors`, at which the rows stand. */
  Eigen::MatrixXd errors(const ErrorSources& sources, const Eigen::MatrixXd& bias_errors) const {
    return T * rowErrors(rows, sources, sources.poses(), bias_errors);
  }
};

/** W such that W^T W is the inverse covariance of T r with exact biases; empty if that is singular.
 */
Eigen::MatrixXd whiteningOf(const CombinedRows& rows, const ErrorSources& sources);

/** Velocities at which the positions of the pairs fit, r_p(k) = 0; the last one's by r_v = 0.
 * Gravity, b_a and poses are the estimate's. */
void solveVelocities(const std::vector<Preintegration>& pairs, VisualFrameEstimate* estimate);

/**
 * Errors of [b_a (3), g_V (3), velocities of solveVelocities()] behind those of b_g.
 * @param scale one row, of the scale; empty: it is exact
 */
void addErrors(const CombinedRows& rows, const std::vector<Preintegration>& pairs,
               const std::vector<SE3>& T_VB, const Eigen::MatrixXd& accel,
               const Eigen::MatrixXd& gravity, const Eigen::MatrixXd& scale, StateErrors* errors);

/** Moves positions and landmarks: the path of the left camera becomes `factor` times as long. */
void rescale(double factor, const std::vector<Eigen::Vector3d>& camera,
             VisualFrameEstimate* estimate);

}  // namespace etalon
