#include "etalon/core/symmetric.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

TEST(Symmetric, EigenvaluesAscendAndVectorsBelongToThem) {
  Eigen::Matrix2d A;
  A << 2.0, 99.0, 1.0, 2.0;  // the upper triangle is not read
  const SymmetricEigen eigen = symmetricEigen(A);
  EXPECT_NEAR(eigen.values[0], 1.0, 1e-12);
  EXPECT_NEAR(eigen.values[1], 3.0, 1e-12);
  EXPECT_NEAR(std::abs(eigen.vectors.col(1).dot(Eigen::Vector2d(1.0, 1.0))), std::sqrt(2.0), 1e-12);
  EXPECT_TRUE(symmetricEigenvalues(A).isApprox(eigen.values));
}

TEST(Symmetric, MahalanobisDistanceIsInStandardDeviations) {
  const Eigen::Vector3d d(2.0, 0.3, 0.0);
  const Eigen::Matrix3d P = Eigen::Vector3d(4.0, 0.01, 1.0).asDiagonal();
  EXPECT_NEAR(squaredMahalanobis(d, P), 1.0 + 9.0, 1e-12);
  EXPECT_NEAR(squaredMahalanobis(d.head<2>(), P.topLeftCorner<2, 2>()), 10.0, 1e-12);
}

}  // namespace
}  // namespace etalon
