#include "etalon/initialization/steps/gravity_sphere.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGravity = 9.81;

double costOf(const Matrix3d& A, const Vector3d& b, const Vector3d& g) {
  return g.dot(A * g) - 2.0 * b.dot(g);
}

/** The least cost over a spiral of `count` points on the sphere, each improved by gradient steps.
 */
double bruteForce(const Matrix3d& A, const Vector3d& b, double radius, int count = 2000) {
  double best = std::numeric_limits<double>::infinity();
  Vector3d at = Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / count, r = std::sqrt(1.0 - z * z);
    const double angle = i * M_PI * (3.0 - std::sqrt(5.0));
    const Vector3d g = radius * Vector3d(r * std::cos(angle), r * std::sin(angle), z);
    if (costOf(A, b, g) < best) {
      best = costOf(A, b, g);
      at = g;
    }
  }
  const double step = 0.5 / (A.norm() + b.norm() / radius);
  for (int i = 0; i < 20000; ++i) {
    at = radius * (at - step * (A * at - b)).normalized();
    best = std::min(best, costOf(A, b, at));
  }
  return best;
}

Matrix3d randomMatrix(std::mt19937* rng) {
  std::normal_distribution<double> normal;
  Matrix3d M;
  for (int i = 0; i < 9; ++i) M(i) = normal(*rng);
  return M;
}

TEST(MinimizeOnSphere, AgreesWithBruteForceOnDefiniteAndIndefiniteMatrices) {
  std::mt19937 rng(1);
  for (int trial = 0; trial < 60; ++trial) {
    const Matrix3d M = randomMatrix(&rng);
    Matrix3d A = M.transpose() * M;
    if (trial % 3 == 1) A = M + M.transpose();
    const double size = trial % 2 == 0 ? 1.0 : 100.0;
    const Vector3d b = size * randomMatrix(&rng).col(0);
    const std::optional<SphereMinimum> minimum = minimizeOnSphere(A, b, kGravity);
    ASSERT_TRUE(minimum);
    EXPECT_NEAR(minimum->g.norm(), kGravity, 1e-12);
    // The gradient steps stop within 1e-9 of the least value, and never below it but for rounding.
    const double best = bruteForce(A, b, kGravity), scale = A.norm() * 96.0 + b.norm() * 10.0;
    EXPECT_NEAR(minimum->cost, best, 1e-9 * scale) << trial;
    EXPECT_LE(minimum->cost, best + 1e-13 * scale) << trial;
    // Stationary: what is left of the gradient is along g.
    EXPECT_LT((A * minimum->g - b).cross(minimum->g).norm() / kGravity, 1e-11 * scale);
  }
}

TEST(MinimizeOnSphere, LaysTheMissingLengthAlongTheWeakestAxisInTheHardCase) {
  const Matrix3d R = expSO3(Vector3d(0.3, -0.8, 0.5));
  const Matrix3d A = R * Vector3d(1.0, 3.0, 7.0).asDiagonal() * R.transpose();
  const Vector3d b = R * Vector3d(0.0, 4.0, 6.0);  // x = (., 2, 1) at mu = -1
  const std::optional<SphereMinimum> minimum = minimizeOnSphere(A, b, 3.0);
  ASSERT_TRUE(minimum);
  EXPECT_NEAR(std::abs((R.transpose() * minimum->g).x()), 2.0, 1e-9);  // 9 - 4 - 1
  EXPECT_NEAR(minimum->cost, bruteForce(A, b, 3.0), 1e-9);
}

TEST(MinimizeOnSphere, IsContinuousAtTheHardCase) {
  const Matrix3d A = Vector3d(1.0, 3.0, 7.0).asDiagonal();
  for (const double small : {1e-3, 1e-6, 1e-9, 1e-12}) {
    const std::optional<SphereMinimum> minimum =
        minimizeOnSphere(A, Vector3d(small, 4.0, 6.0), 3.0);
    ASSERT_TRUE(minimum);
    EXPECT_NEAR(minimum->g.x(), 2.0, 10.0 * small + 1e-9);  // on the side that b points to
  }
}

TEST(MinimizeOnSphere, HandlesEqualEigenvaluesAndNoLinearTerm) {
  const std::optional<SphereMinimum> plain =
      minimizeOnSphere(Matrix3d::Identity(), Vector3d(0, 0, -2), kGravity);
  ASSERT_TRUE(plain);
  EXPECT_LT((plain->g - Vector3d(0, 0, -kGravity)).norm(), 1e-12);
  // Linear in g alone.
  const std::optional<SphereMinimum> linear =
      minimizeOnSphere(Matrix3d::Zero(), Vector3d(3, 0, 4), 5.0);
  ASSERT_TRUE(linear);
  EXPECT_LT((linear->g - Vector3d(3, 0, 4)).norm(), 1e-12);
  const std::optional<SphereMinimum> nothing =
      minimizeOnSphere(Matrix3d::Zero(), Vector3d::Zero(), kGravity);
  ASSERT_TRUE(nothing);
  EXPECT_NEAR(nothing->g.norm(), kGravity, 1e-12);
}

TEST(MinimizeOnSphere, RefusesWhatIsNotFiniteAndANegativeRadius) {
  Matrix3d A = Matrix3d::Identity();
  EXPECT_FALSE(minimizeOnSphere(A, Vector3d::UnitX(), 0.0));
  A(0, 0) = std::nan("");
  EXPECT_FALSE(minimizeOnSphere(A, Vector3d::UnitX(), 1.0));
}

/** A tall random system whose solution has |g| = kGravity up to noise. */
struct System {
  explicit System(unsigned seed, double noise) {
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal;
    const int n = 12, rows = 60;
    MatrixXd J(rows, n + 3);
    for (Eigen::Index i = 0; i < J.size(); ++i) J(i) = normal(rng);
    x.resize(n + 3);
    for (Eigen::Index i = 0; i < x.size(); ++i) x(i) = normal(rng);
    x.tail<3>() *= kGravity / x.tail<3>().norm();
    VectorXd y = J * x;
    for (Eigen::Index i = 0; i < y.size(); ++i) y(i) += noise * normal(rng);
    A = J.transpose() * J;
    b = J.transpose() * y;
  }
  MatrixXd A;
  VectorXd b, x;
};

TEST(NormConstrained, FindsTheTrueSolutionWithoutNoise) {
  const System s(3, 0.0);
  const NormConstrainedSolution solution = solveNormConstrained(s.A, s.b, kGravity);
  ASSERT_TRUE(solution.summary.usable());
  EXPECT_LT((solution.x - s.x).norm(), 1e-10);
}

TEST(NormConstrained, IsStationaryAndAgreesWithTheTangentPlane) {
  const System s(4, 1.0);
  const NormConstrainedSolution solution = solveNormConstrained(s.A, s.b, kGravity);
  ASSERT_TRUE(solution.summary.usable());
  const VectorXd gradient = s.A * solution.x - s.b;
  const Vector3d g = solution.x.tail<3>();
  EXPECT_LT(gradient.head(12).norm(), 1e-9);                       // free in y
  EXPECT_LT(gradient.tail<3>().cross(g).norm() / kGravity, 1e-9);  // along g alone
  EXPECT_NEAR(solution.summary.final_cost,
              0.5 * solution.x.dot(s.A * solution.x) - s.b.dot(solution.x), 1e-9);

  const Vector3d seed = expSO3(Vector3d(0.1, -0.1, 0.05)) * g;
  const NormConstrainedSolution refined = refineOnTangentPlane(s.A, s.b, kGravity, seed);
  ASSERT_TRUE(refined.summary.usable());
  // Each iteration forgets the multiplier: linear convergence with a ratio of about
  // |multiplier| / smallest eigenvalue, here some hundredths.
  EXPECT_LT((refined.x - solution.x).norm(), 1e-4);
  EXPECT_GE(refined.summary.final_cost, solution.summary.final_cost - 1e-9);
  EXPECT_GE(refined.summary.initial_cost, refined.summary.final_cost - 1e-9);
  EXPECT_EQ(refined.summary.iterations, 4);
}

TEST(NormConstrained, RefusesUnknownsThatAreNotDetermined) {
  System s(5, 0.0);
  s.A.row(2).setZero();
  s.A.col(2).setZero();
  s.b(2) = 0.0;
  EXPECT_EQ(solveNormConstrained(s.A, s.b, kGravity).summary.termination, Termination::kSingular);
}

TEST(NormConstrained, RefusesUnknownsWhosePivotIsRounding) {
  std::mt19937 rng(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    // Six rows for nine unknowns, in units that differ by six orders of magnitude.
    MatrixXd rows = MatrixXd::NullaryExpr(6, 9, [&] { return normal(rng); });
    rows.col(2) *= 1e3;
    rows.col(5) *= 1e-3;
    const MatrixXd A = rows.transpose() * rows;
    const VectorXd b = rows.transpose() * VectorXd::Ones(6);
    EXPECT_EQ(refineOnTangentPlane(A, b, kGravity, Vector3d(0, 0, -1)).summary.termination,
              Termination::kSingular);
  }
}

TEST(TangentBasis, SpansTheOrthogonalPlane) {
  for (const Vector3d& g : {Vector3d(0, 0, -9.81), Vector3d(9.81, 0, 0), Vector3d(1, 2, 3)}) {
    const Eigen::Matrix<double, 3, 2> B = tangentBasis(g);
    EXPECT_LT((B.transpose() * B - Eigen::Matrix2d::Identity()).norm(), 1e-14);
    EXPECT_LT((B.transpose() * g).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace etalon
