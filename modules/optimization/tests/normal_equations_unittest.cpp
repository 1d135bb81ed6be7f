#include "etalon/optimization/bundle/normal_equations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace etalon {
namespace {

using Eigen::MatrixXd;

/** Of `rows` equations for eight unknowns whose units differ by up to eight orders of magnitude. */
MatrixXd information(int rows, std::mt19937* random) {
  std::normal_distribution<double> normal;
  MatrixXd A = MatrixXd::NullaryExpr(rows, 8, [&] { return normal(*random); });
  for (Eigen::Index i = 0; i < A.cols(); ++i) A.col(i) *= std::pow(10.0, i - 4.0);
  return A.transpose() * A;
}

TEST(NormalEquations, AreDeterminedByAsManyEquationsAsUnknownsAndNotByFewer) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 200; ++trial) {
    EXPECT_TRUE(ScaledCholesky(information(12, &random)).determined());
    for (const int rows : {3, 6, 7}) {
      const MatrixXd singular = information(rows, &random);
      EXPECT_FALSE(ScaledCholesky(singular).determined()) << rows;
      EXPECT_EQ(inverseOrEmpty(singular).size(), 0) << rows;
    }
  }
}

TEST(NormalEquations, ReadTheLowerTriangle) {
  std::mt19937 random(4);
  MatrixXd H = information(12, &random);
  H.triangularView<Eigen::StrictlyUpper>().setZero();
  EXPECT_TRUE(ScaledCholesky(H).determined());
}

TEST(NormalEquations, AreNotDeterminedWhereTheyAreNotFiniteOrZero) {
  MatrixXd H = MatrixXd::Identity(3, 3);
  H(1, 1) = 0.0;
  EXPECT_FALSE(ScaledCholesky(H).determined());
  H(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ScaledCholesky(H).determined());
  H = MatrixXd::Identity(3, 3);
  H(2, 0) = H(0, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ScaledCholesky(H).determined());
}

TEST(NormalEquations, GiveNoCovarianceThatIsNotFinite) {
  const MatrixXd curvature = MatrixXd::Identity(3, 3);
  MatrixXd score = curvature;
  EXPECT_EQ(covarianceOrEmpty(curvature, score), score);
  score(1, 2) = score(2, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(covarianceOrEmpty(curvature, score).size(), 0);
}

}  // namespace
}  // namespace etalon
