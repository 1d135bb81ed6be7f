#pragma once

// Damped Gauss-Newton over a window. Private to the module.

#include <Eigen/Cholesky>

#include "visual_terms.h"

namespace etalon::fixed_lag {

struct SolverOptions {
  int iterations = 3;
  /** Converged is a step shorter than this in its own standard deviations, all states together: it
   * is the last. Over a hundred unknowns that is a tenth of each one's. Where the newest state is no
   * keyframe, three times as long: what would follow it is shorter by an order of magnitude, and
   * the next frame takes it. */
  double converged_sigmas = 1.0;
};

struct SolverResult {
  int iterations = 0;  ///< steps that were taken
  double cost = 0.0;
  bool converged = false;
  /** Of the newest state's error, 15 x 15; zero if the equations are not positive definite. */
  Matrix15d covariance = Matrix15d::Zero();
};

/** The whitened inertial residual that ends in full state `i`, and its derivatives (both or none).
 */
Vector15d inertialRows(const Window& window, size_t i, Matrix15d* J_i = nullptr,
                       Matrix15d* J_j = nullptr);
/** Adds the inertial terms between the full states. */
void addInertialTerms(const Window& window, NormalEquations* equations);
/** Adds the prior; @param H its A^T A */
void addPrior(const Window& window, const Eigen::MatrixXd& H, NormalEquations* equations);
/** The errors of the first `unknowns` columns about the linearisation points. */
Eigen::VectorXd deltas(const Window& window, Eigen::Index unknowns);

/**
 * Minimises the window's cost: prior, IMU and pixels. Normal equations with the landmarks
 * eliminated, Cholesky; damped (Levenberg-Marquardt) only where a plain step does not lower the
 * cost. Every second plain step has the matrix of the one before (Shamanskii 1967) and a gradient of
 * its own. Retained keyframes that no landmark of the window is seen in are in the prior alone: they
 * are eliminated once, and follow the others.
 */
class WindowSolver {
 public:
  explicit WindowSolver(const SolverOptions& options) : options_(options) {}
  /**
   * @param iterations most steps; SolverOptions::iterations where nothing else is wanted
   * @param same_prior the window has states and prior of the last call, and observations more
   */
  SolverResult solve(Window* window, int iterations, bool same_prior);
  /**
   * Uses another calibration: states and landmarks go where they are best with it, to first order.
   * @return false, and nothing has changed, if the equations are not positive definite
   */
  bool moveCalibration(const CalibrationVector& to, Window* window);
  /**
   * Joint covariance of the errors of these unknowns, from the last solve(); empty if that found
   * none. The window has the same states since.
   */
  Eigen::MatrixXd covariance(const std::vector<Eigen::Index>& unknowns) const;

 private:
  void begin(Window* window, bool same_prior);
  void eliminateUntouched(const Window& window);
  bool factorize(const NormalEquations& equations, double damping);
  Eigen::VectorXd stepOf(const NormalEquations& equations) const;
  void linearize(Window* window, NormalEquations* equations, bool calibration = false);
  /** Gradient and cost at the estimates; landmarks are eliminated as in the last linearize(). */
  NormalEquations gradient(const Window& window);
  double costOf(const Window& window) const;

  SolverOptions options_;
  VisualTerms visual_;
  std::vector<Landmark*> landmarks_;
  Eigen::MatrixXd prior_H_;  ///< A^T A of the prior
  /** Unknowns by what is done with them: eliminated before the others, or not. */
  std::vector<Eigen::Index> untouched_, rest_;
  Eigen::LLT<Eigen::MatrixXd> untouched_factor_;
  Eigen::MatrixXd untouched_rest_;  ///< their block of the equations
  Eigen::MatrixXd follows_;         ///< its product with the inverse of the untouched's block
  Eigen::VectorXd scale_;           ///< of rest_
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace etalon::fixed_lag
