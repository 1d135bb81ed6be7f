#include "etalon/optimization/marginalization/linear_rows.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace etalon {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LinearRows randomRows(Eigen::Index rows, Eigen::Index unknowns, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  LinearRows out(rows, unknowns);
  for (Eigen::Index c = 0; c < unknowns; ++c)
    // Units that differ as those of positions and biases do.
    for (Eigen::Index r = 0; r < rows; ++r)
      out.A(r, c) = normal(generator) * std::pow(10.0, static_cast<double>(c % 5));
  for (Eigen::Index r = 0; r < rows; ++r) out.b[r] = normal(generator);
  return out;
}

MatrixXd informationOf(const LinearRows& rows) { return rows.A.transpose() * rows.A; }
VectorXd gradientOf(const LinearRows& rows) { return rows.A.transpose() * rows.b; }

TEST(LinearRows, MarginalizedIsTheSchurComplement) {
  const LinearRows rows = randomRows(40, 20, 1);
  const LinearRows left = marginalizeFirst(rows, 8);
  EXPECT_EQ(left.rows(), 32);
  const MatrixXd H = informationOf(rows);
  const VectorXd g = gradientOf(rows);
  const MatrixXd K = H.bottomLeftCorner(12, 8) * H.topLeftCorner(8, 8).inverse();
  const MatrixXd expected = H.bottomRightCorner(12, 12) - K * H.topRightCorner(8, 12);
  const VectorXd expected_g = g.tail(12) - K * g.head(8);
  EXPECT_LT((informationOf(left) - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT((gradientOf(left) - expected_g).norm(), 1e-9 * expected_g.norm());
}

TEST(LinearRows, RowsWithoutTheLeavingUnknownsStay) {
  LinearRows rows = randomRows(30, 10, 2);
  rows.A.topLeftCorner(20, 3).setZero();
  const LinearRows left = marginalizeFirst(rows, 3);
  EXPECT_EQ(left.rows(), 27);
  EXPECT_EQ(left.A.bottomRows(20), rows.A.topRightCorner(20, 7));
}

TEST(LinearRows, AnUnknownThatNothingDeterminesTakesNoRow) {
  LinearRows rows = randomRows(10, 6, 3);
  rows.A.col(1).setZero();
  EXPECT_EQ(marginalizeFirst(rows, 2).rows(), 9);
  rows.A.col(1) = 3.0 * rows.A.col(0);  // zero once the first is eliminated
  EXPECT_EQ(marginalizeFirst(rows, 2).rows(), 9);
}

TEST(LinearRows, CompressedIsTheSameCost) {
  const LinearRows rows = randomRows(60, 12, 4);
  const LinearRows few = compressed(rows);
  EXPECT_EQ(few.rows(), 12);
  EXPECT_LT((informationOf(few) - informationOf(rows)).norm(), 1e-12 * informationOf(rows).norm());
  EXPECT_LT((gradientOf(few) - gradientOf(rows)).norm(), 1e-12 * gradientOf(rows).norm());
}

TEST(LinearRows, CompressedStaysTriangularWithTheLastUnknownsInTheFirstRows) {
  const LinearRows few = compressed(randomRows(60, 12, 4));
  const auto expectTriangular = [](const LinearRows& rows) {
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
      EXPECT_EQ(rows.A.row(i).tail(i), Eigen::RowVectorXd::Zero(i)) << i;
  };
  expectTriangular(few);
  // Three rows more, as a slide adds them: the cost is theirs and that of the triangle.
  const LinearRows more = randomRows(3, 12, 5);
  LinearRows all(15, 12);
  all.A << few.A, more.A;
  all.b << few.b, more.b;
  const LinearRows again = compressed(all);
  EXPECT_EQ(again.rows(), 12);
  expectTriangular(again);
  EXPECT_LT((informationOf(again) - informationOf(all)).norm(), 1e-12 * informationOf(all).norm());
  EXPECT_LT((gradientOf(again) - gradientOf(all)).norm(), 1e-12 * gradientOf(all).norm());
}

TEST(LinearRows, SquareRootOfASemidefiniteMatrix) {
  // Eight rows over twelve unknowns: rank eight, and an unknown that nothing touches.
  LinearRows rows = randomRows(8, 12, 5);
  rows.A.col(7).setZero();
  const LinearRows root = squareRoot(informationOf(rows), gradientOf(rows));
  EXPECT_EQ(root.rows(), 8);
  EXPECT_LT((informationOf(root) - informationOf(rows)).norm(), 1e-12 * informationOf(rows).norm());
  EXPECT_LT((gradientOf(root) - gradientOf(rows)).norm(), 1e-10 * gradientOf(rows).norm());
}

}  // namespace
}  // namespace etalon
