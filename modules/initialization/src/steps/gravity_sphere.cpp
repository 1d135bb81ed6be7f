#include "etalon/initialization/steps/gravity_sphere.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Norm of the solution of (diag(gap) + s I) x = beta. */
double solutionNorm(const Vector3d& beta, const Vector3d& gap, double s) {
  return (beta.array() / (gap.array() + s)).matrix().norm();
}

/**
 * The root s > 0 of |x(s)| = radius, x_i = beta_i / (gap_i + s): Newton on 1/|x| - 1/radius, which
 * is concave and nearly linear in s, kept in a bracket that shrinks.
 */
double secularRoot(const Vector3d& beta, const Vector3d& gap, double radius) {
  // With gap >= 0: |x(s)| <= |beta| / s, and |x(s)| >= |beta_i| / (gap_i + s) for every i.
  double high = beta.norm() / radius;
  double low = std::max(0.0, (beta.array().abs() / radius - gap.array()).maxCoeff());
  double s = low > 0.0 ? low : 0.5 * high;
  for (int iteration = 0; iteration < 200 && high - low > 1e-15 * high; ++iteration) {
    const double norm = solutionNorm(beta, gap, s);
    if (norm > radius)
      low = s;
    else
      high = s;
    const double slope =
        (beta.array().square() / (gap.array() + s).cube()).sum() / (norm * norm * norm);
    const double newton = s + (1.0 / radius - 1.0 / norm) / slope;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - s) <= 1e-16 * s) break;
    s = next;
  }
  return s;
}

/** A, b split into y and g, and y eliminated. */
struct Reduced {
  ScaledCholesky factor_y;
  MatrixXd A_yg;
  VectorXd b_y;
  Matrix3d A_g;
  Vector3d b_g;
  double cost_y = 0.0;  ///< -b_y^T A_yy^-1 b_y
  bool ok = false;

  Reduced(const MatrixXd& A, const VectorXd& b) {
    const Eigen::Index n = A.rows() - 3;
    A_g = A.bottomRightCorner<3, 3>();
    b_g = b.tail<3>();
    ok = A.allFinite() && b.allFinite();
    if (n == 0 || !ok) return;
    A_yg = A.topRightCorner(n, 3);
    b_y = b.head(n);
    factor_y = ScaledCholesky(A.topLeftCorner(n, n));
    ok = factor_y.determined();
    if (!ok) return;
    const VectorXd y = factor_y.solve(b_y);
    A_g -= A_yg.transpose() * factor_y.solve(A_yg);
    A_g = (0.5 * (A_g + A_g.transpose())).eval();
    b_g -= A_yg.transpose() * y;
    cost_y = -b_y.dot(y);
    ok = A_g.allFinite() && b_g.allFinite();
  }

  NormConstrainedSolution solution(const Vector3d& g) const {
    NormConstrainedSolution result;
    result.A_g = A_g;
    result.summary.initial_cost = result.summary.final_cost = cost(g);
    result.x.resize(b_y.size() + 3);
    if (b_y.size() > 0) result.x.head(b_y.size()) = factor_y.solve(b_y - A_yg * g);
    result.x.tail<3>() = g;
    result.summary.termination =
        result.x.allFinite() ? Termination::kConverged : Termination::kFailed;
    return result;
  }

  /** (x^T A x) / 2 - b^T x with y at its best. */
  double cost(const Vector3d& g) const {
    return 0.5 * (cost_y + g.dot(A_g * g) - 2.0 * b_g.dot(g));
  }
};

}  // namespace

std::optional<SphereMinimum> minimizeOnSphere(const Matrix3d& A, const Vector3d& b, double radius) {
  if (!A.allFinite() || !b.allFinite() || !(radius > 0.0)) return std::nullopt;
  SphereMinimum result;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(A);
  const Vector3d& lambda = eigen.eigenvalues();  // increasing
  const Vector3d gap = lambda.array() - lambda(0);
  Vector3d beta = eigen.eigenvectors().transpose() * b;

  // What cannot be told from zero: rounding of the eigenvectors, times the size of the problem.
  constexpr double kRounding = 1e-14;
  const double scale = std::max(lambda.cwiseAbs().maxCoeff(), beta.norm() / radius);
  const auto is_weakest = [&](int i) { return gap(i) <= kRounding * scale; };
  Vector3d x = Vector3d::Zero();
  double weakest = 0.0;  // |b| in the eigenspace of l_min
  for (int i = 0; i < 3; ++i) {
    if (is_weakest(i))
      weakest = std::hypot(weakest, beta(i));
    else
      x(i) = beta(i) / gap(i);
  }
  if (weakest <= kRounding * scale * radius && x.norm() <= radius) {
    x(0) = std::sqrt(std::max(0.0, radius * radius - x.squaredNorm()));
  } else {
    const double s = secularRoot(beta, gap, radius);  // mu + l_min
    x = beta.array() / (gap.array() + s);
  }
  result.g = radius * (eigen.eigenvectors() * x).normalized();
  result.cost = result.g.dot(A * result.g) - 2.0 * b.dot(result.g);
  if (!result.g.allFinite()) return std::nullopt;
  return result;
}

namespace {

NormConstrainedSolution solutionNotDetermined() {
  NormConstrainedSolution result;
  result.summary.stop(Termination::kSingular,
                      "gravity or the unknowns besides it are not determined");
  return result;
}

}  // namespace

NormConstrainedSolution solveNormConstrained(const MatrixXd& A, const VectorXd& b, double radius) {
  const Reduced reduced(A, b);
  if (!reduced.ok) return solutionNotDetermined();
  const std::optional<SphereMinimum> minimum = minimizeOnSphere(reduced.A_g, reduced.b_g, radius);
  if (!minimum) return solutionNotDetermined();
  return reduced.solution(minimum->g);
}

MatrixXd tangentUnknowns(Eigen::Index n, const Vector3d& g) {
  MatrixXd T = MatrixXd::Zero(n + 3, n + 2);
  T.topLeftCorner(n, n).setIdentity();
  T.bottomRightCorner<3, 2>() = tangentBasis(g);
  return T;
}

NormConstrainedSolution refineOnTangentPlane(const MatrixXd& A, const VectorXd& b, double radius,
                                             const Vector3d& g_seed, int iterations) {
  const Reduced reduced(A, b);
  if (!reduced.ok) return solutionNotDetermined();
  Vector3d g = radius * g_seed.normalized();
  // Of all unknowns: what elimination leaves of a gravity that nothing determines is rounding.
  const MatrixXd T = tangentUnknowns(A.rows() - 3, g);
  if (!ScaledCholesky(T.transpose() * A * T).determined()) return solutionNotDetermined();
  const double initial_cost = reduced.cost(g);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const Eigen::Matrix<double, 3, 2> B = tangentBasis(g);
    const Eigen::Matrix2d H = B.transpose() * reduced.A_g * B;
    const Eigen::LDLT<Eigen::Matrix2d> factor(H);
    const Eigen::Vector2d w = factor.solve(B.transpose() * (reduced.b_g - reduced.A_g * g));
    if (!factor.isPositive() || !w.allFinite()) return solutionNotDetermined();
    g = radius * (g + B * w).normalized();
  }
  NormConstrainedSolution result = reduced.solution(g);
  result.summary.iterations = iterations;
  result.summary.initial_cost = initial_cost;
  return result;
}

}  // namespace etalon
