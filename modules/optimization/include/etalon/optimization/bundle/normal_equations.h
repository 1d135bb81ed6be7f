#pragma once

// Normal equations and their inverse.

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace etalon {

/**
 * Normal equations of the poses and of what else the caller adds, landmarks eliminated, twice:
 *
 *   score      Gauss-Newton's matrix: the covariance of the gradient at the truth,
 *   curvature  the second derivatives of the cost: what the gradient grows by with an error.
 *
 * They differ by one term of the visual part, the residual times the mixed derivative by inverse
 * depth and position. Far landmarks need it: parallax that is noise looks like information to
 * Gauss-Newton (a baseline times an inverse depth that was fitted to the same noise), and the
 * curvature does not have it. Every other second derivative is smaller than what stands beside it
 * by the size of a residual, about 1e-3 rad. (Positions relative to the first pose that saw the
 * landmark, in its body's frame: moving all together changes no term.)
 *
 * The covariance of the estimate is curvature^-1 score curvature^-1 (Huber, The behavior of maximum
 * likelihood estimates under nonstandard conditions, 1967); with near landmarks the two agree and
 * it is the inverse of either.
 */
struct NormalEquations {
  explicit NormalEquations(Eigen::Index size)
      : score(Eigen::MatrixXd::Zero(size, size)), curvature(score) {}
  Eigen::MatrixXd score, curvature;

  /** Adds to both at (row, column) what the residuals of no landmark contribute. */
  template <typename Derived>
  void add(Eigen::Index row, Eigen::Index column, const Eigen::MatrixBase<Derived>& block) {
    score.block(row, column, block.rows(), block.cols()) += block;
    curvature.block(row, column, block.rows(), block.cols()) += block;
  }
};

/**
 * Cholesky factor of a symmetric matrix, of which the lower triangle is read, scaled to a unit
 * diagonal: the units of its blocks differ by many orders of magnitude. Positive pivots do not say
 * that the unknowns are determined, because those of a singular matrix are rounding errors of either
 * sign; the condition of the scaled matrix does.
 */
class ScaledCholesky {
 public:
  ScaledCholesky() = default;
  explicit ScaledCholesky(const Eigen::MatrixXd& information);

  /** Whether the matrix is numerically positive definite: solve() may be called only then. */
  bool determined() const { return determined_; }

  /** information^-1 rhs. */
  template <typename Derived>
  Eigen::Matrix<double, Eigen::Dynamic, Derived::ColsAtCompileTime> solve(
      const Eigen::MatrixBase<Derived>& rhs) const {
    Eigen::Matrix<double, Eigen::Dynamic, Derived::ColsAtCompileTime> x = scale_.asDiagonal() * rhs;
    factor_.solveInPlace(x);
    return scale_.asDiagonal() * x;
  }

 private:
  Eigen::VectorXd scale_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  bool determined_ = false;
};

/** Inverse of a symmetric positive definite matrix, symmetrised; empty if it is not numerically so.
 */
Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information);

/** curvature^-1 score curvature^-1; empty if the curvature is not positive definite
 * or the result not finite. */
Eigen::MatrixXd covarianceOrEmpty(const Eigen::MatrixXd& curvature, const Eigen::MatrixXd& score);

}  // namespace etalon
