#include "chain.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace etalon::ground_truth {
namespace {

constexpr size_t kNodes = 4;
constexpr Eigen::Index kSize = static_cast<Eigen::Index>(kNodes) * kNodeSize + kBorderSize;

Eigen::Index at(size_t k) { return static_cast<Eigen::Index>(k) * kNodeSize; }

/** A positive definite matrix with the pattern of the chain. */
Eigen::MatrixXd dense() {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kSize, kSize);
  for (Eigen::Index i = 0; i < kSize; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) A(i, j) = A(j, i) = normal(random);
  for (size_t i = 0; i < kNodes; ++i)
    for (size_t j = 0; j < kNodes; ++j)
      if (i > j + 1 || j > i + 1) A.block<kNodeSize, kNodeSize>(at(i), at(j)).setZero();
  A.diagonal().array() += 40.0;
  return A;
}

ChainEquations equationsOf(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  ChainEquations equations(kNodes);
  for (size_t k = 0; k < kNodes; ++k) {
    equations.diagonal[k] = A.block<kNodeSize, kNodeSize>(at(k), at(k));
    equations.border[k] = A.block<kNodeSize, kBorderSize>(at(k), at(kNodes));
    equations.rhs[k] = b.segment<kNodeSize>(at(k));
    if (k + 1 < kNodes) equations.next[k] = A.block<kNodeSize, kNodeSize>(at(k), at(k + 1));
  }
  equations.border_diagonal = A.bottomRightCorner<kBorderSize, kBorderSize>();
  equations.border_rhs = b.tail<kBorderSize>();
  return equations;
}

TEST(Chain, AgreesWithTheDenseSolution) {
  const Eigen::MatrixXd A = dense();
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(kSize, -1.0, 2.0);
  ChainSolver solver;
  ASSERT_TRUE(solver.factorize(equationsOf(A, b)));
  const Eigen::VectorXd x = A.llt().solve(b);
  const Eigen::MatrixXd P = A.inverse();
  const ChainCovariance covariance = solver.covariance();
  for (size_t k = 0; k < kNodes; ++k) {
    EXPECT_LT((solver.nodes()[k] - x.segment<kNodeSize>(at(k))).norm(), 1e-12);
    EXPECT_LT((covariance.diagonal[k] - P.block<kNodeSize, kNodeSize>(at(k), at(k))).norm(), 1e-12);
    EXPECT_LT((covariance.border[k] - P.block<kNodeSize, kBorderSize>(at(k), at(kNodes))).norm(),
              1e-12);
    if (k + 1 == kNodes) break;
    EXPECT_LT((covariance.next[k] - P.block<kNodeSize, kNodeSize>(at(k), at(k + 1))).norm(), 1e-12);
  }
  EXPECT_LT((solver.border() - x.tail<kBorderSize>()).norm(), 1e-12);
  EXPECT_LT((solver.borderCovariance() - P.bottomRightCorner<kBorderSize, kBorderSize>()).norm(),
            1e-12);
  const Eigen::MatrixXd L = A.llt().matrixL();
  EXPECT_NEAR(solver.logDeterminant(), 2.0 * L.diagonal().array().log().sum(), 1e-10);
}

TEST(Chain, WhatIsNotPositiveDefiniteIsSaid) {
  Eigen::MatrixXd A = dense();
  A(30, 30) = -1.0;
  ChainSolver solver;
  EXPECT_FALSE(solver.factorize(equationsOf(A, Eigen::VectorXd::Zero(kSize))));
}

}  // namespace
}  // namespace etalon::ground_truth
