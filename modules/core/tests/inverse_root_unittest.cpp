#include "etalon/core/inverse_root.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace etalon {
namespace {

TEST(InverseRoot, TimesItsTransposeIsTheInverse) {
  Eigen::Matrix3d A;
  A << 2.0, -1.0, 0.5, 0.3, 3.0, -0.7, 1e-3, 2e-3, 1e-4;
  const Eigen::Matrix3d V = A * A.transpose(), U = inverseRoot(V);
  EXPECT_TRUE(U.isUpperTriangular());
  EXPECT_LT((U * U.transpose() * V - Eigen::Matrix3d::Identity()).norm(), 1e-8);
  Eigen::Matrix3d lower = V;
  lower.triangularView<Eigen::StrictlyUpper>().setZero();
  EXPECT_EQ(inverseRoot(lower), U);
}

TEST(InverseRoot, IsNotFiniteWhereThereIsNone) {
  EXPECT_FALSE(inverseRoot(Eigen::Matrix3d::Zero()).allFinite());
  EXPECT_FALSE(inverseRoot(Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal()).allFinite());
}

TEST(InverseRoot, TheBestWithAGivenThirdHasNoSlopeAlongTheOthers) {
  Eigen::Matrix3d V;
  V << 4.0, 1.0, 0.5, 1.0, 3.0, -0.7, 0.5, -0.7, 2.0;
  const Eigen::Vector3d best(1.0, -2.0, 0.3);
  const Eigen::Vector3d held = withThird(best, -0.4, inverseRoot(V));
  EXPECT_NEAR(held.z(), -0.4, 1e-12);
  EXPECT_LT((V * (held - best)).head<2>().norm(), 1e-12);
}

}  // namespace
}  // namespace etalon
