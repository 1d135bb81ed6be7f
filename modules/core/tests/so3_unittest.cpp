#include "etalon/core/so3.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/** Unit axes: the coordinate axes, both signs, and general ones. */
std::vector<Vector3d> axes() {
  std::vector<Vector3d> all;
  for (int i = 0; i < 3; ++i) {
    all.push_back(Vector3d::Unit(i));
    all.push_back(-Vector3d::Unit(i));
  }
  all.push_back(Vector3d(1, 1, 1).normalized());
  all.push_back(Vector3d(-0.3, 0.9, 0.2).normalized());
  all.push_back(Vector3d(1e-5, -1, 2e-5).normalized());  // nearly along an axis
  return all;
}

/** Angles around every switch between series and closed form, and up to pi. */
std::vector<double> angles() {
  return {0.0,     1e-300, 1e-12, 1e-9, 0.99e-7, 1.01e-7, 2.1e-7, 0.99e-4,     1.01e-4,
          0.99e-3, 1.1e-3, 0.1,   1.0,  M_PI_2,  3.0,     3.14,   M_PI - 1e-6, M_PI - 1e-9};
}

TEST(SO3, HatIsTheCrossProduct) {
  const Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_EQ(hat(a) * b, a.cross(b));
  EXPECT_EQ(hat(a).transpose(), -hat(a));
}

TEST(SO3, ExpIsTheRotationAboutTheAxis) {
  for (const Vector3d& axis : axes()) {
    for (double angle : angles()) {
      const Matrix3d R = expSO3(angle * axis);
      // Rodrigues' formula as Eigen computes it; a few roundings.
      EXPECT_TRUE(R.isApprox(Eigen::AngleAxisd(angle, axis).toRotationMatrix(), 1e-14)) << angle;
      EXPECT_LT((R.transpose() * R - Matrix3d::Identity()).norm(), 1e-14) << angle;
    }
  }
}

TEST(SO3, LogInvertsExp) {
  for (const Vector3d& axis : axes()) {
    for (double angle : angles()) {
      const Vector3d phi = angle * axis;
      // Rounding of R's entries (1e-16) is all there is, at tiny angles and next to pi as well.
      EXPECT_LT((logSO3(expSO3(phi)) - phi).norm(), 2e-15 + 1e-15 * angle)
          << angle << ", axis " << axis.transpose();
    }
  }
}

TEST(SO3, LogKeepsTinyAnglesRelatively) {
  const Vector3d phi(3e-12, -4e-12, 1e-12);
  EXPECT_LT((logSO3(expSO3(phi)) - phi).norm(), 1e-14 * phi.norm());
}

TEST(SO3, LogAtPiIsOneOfTheTwoVectors) {
  for (const Vector3d& axis : axes()) {
    const Matrix3d R = Eigen::AngleAxisd(M_PI, axis).toRotationMatrix();
    const Vector3d phi = logSO3(R);
    EXPECT_LE(phi.norm(), M_PI + 1e-15);
    EXPECT_NEAR(phi.norm(), M_PI, 1e-14);
    EXPECT_NEAR(std::abs(phi.normalized().dot(axis)), 1.0, 1e-14);
    EXPECT_TRUE(expSO3(phi).isApprox(R, 1e-14));
  }
  EXPECT_NEAR(logSO3(Vector3d(1, -1, -1).asDiagonal()).norm(), M_PI, 1e-15);
}

TEST(SO3, LogIsTheShorterWayRound) {
  const Vector3d axis = Vector3d(-0.3, 0.9, 0.2).normalized();
  const Vector3d phi = logSO3(expSO3((M_PI + 0.5) * axis));
  EXPECT_LT((phi + (M_PI - 0.5) * axis).norm(), 1e-14);
}

TEST(SO3, LogForgivesRounding) {
  // A rotation that drifted: the scale must not enter the angle.
  const Vector3d phi(0.4, -0.7, 0.2);
  EXPECT_LT((logSO3(expSO3(phi) * (1.0 + 1e-9)) - phi).norm(), 3e-9);
}

/** Truncation h^4 = 1e-12, rounding 1e-16 / h = 1e-13; relative to 1 and norms of two to five. */
constexpr testing::DifferenceOptions kDifferences{1e-3, 1e-10};

TEST(SO3, RightJacobianAgreesWithNumericalOne) {
  for (const Vector3d& axis : axes())
    for (double angle : angles()) {
      SCOPED_TRACE(angle);
      const Vector3d phi = angle * axis;
      const Matrix3d R_transposed = expSO3(phi).transpose();
      testing::expectJacobian(
          rightJacobianSO3(phi),
          [&](const Vector3d& x) { return logSO3(R_transposed * expSO3(x)); }, phi, kDifferences);
    }
}

TEST(SO3, RightJacobianInverseAgreesWithNumericalOne) {
  for (const Vector3d& axis : axes())
    for (double angle : angles()) {
      if (angle > 3.1) continue;  // the differences would step over pi
      SCOPED_TRACE(angle);
      const Vector3d phi = angle * axis;
      testing::expectJacobian(
          rightJacobianInverseSO3(phi), [](const Matrix3d& R) { return logSO3(R); }, expSO3(phi),
          kDifferences);
    }
}

TEST(SO3, RightJacobianInverseIsTheInverse) {
  for (const Vector3d& axis : axes()) {
    for (double angle : angles()) {
      const Vector3d phi = angle * axis;
      const Matrix3d product = rightJacobianInverseSO3(phi) * rightJacobianSO3(phi);
      EXPECT_LT((product - Matrix3d::Identity()).norm(), 1e-14) << angle;  // rounding
    }
    const Vector3d beyond = 5.0 * axis;  // defined up to 2 pi
    EXPECT_LT(
        (rightJacobianInverseSO3(beyond) * rightJacobianSO3(beyond) - Matrix3d::Identity()).norm(),
        1e-13);
  }
}

TEST(SO3, NearestRotationProjects) {
  const Matrix3d R = expSO3({0.4, -0.7, 0.2});
  EXPECT_TRUE(nearestRotation(R).isApprox(R, 1e-14));
  EXPECT_TRUE(nearestRotation(1.01 * R).isApprox(R, 1e-14));
  Matrix3d symmetric;
  symmetric << 1, 0.02, -0.01, 0.02, 1.1, 0.03, -0.01, 0.03, 0.9;
  EXPECT_TRUE(nearestRotation(R * symmetric).isApprox(R, 1e-14));  // the polar factor
  const Matrix3d reflection = -Matrix3d::Identity();
  EXPECT_NEAR(nearestRotation(reflection).determinant(), 1.0, 1e-14);
}

TEST(SO3, AngleBetweenIsAccurateEverywhere) {
  const Vector3d a(0, 0, -9.81);
  for (double angle : {0.0, 1e-12, 1e-8, 0.3, M_PI_2, 3.0, M_PI - 1e-10, M_PI}) {
    const Vector3d b = 0.01 * (expSO3({angle, 0, 0}) * a);
    EXPECT_NEAR(angleBetween(a, b), angle, 1e-15 + 1e-15 * angle);
  }
}

TEST(SO3, RotationBetweenTurnsByTheLeastAngle) {
  const Vector3d from(0.3, -2.0, 9.6);
  for (const Vector3d& to : axes()) {
    const Matrix3d R = rotationBetween(from, to);
    EXPECT_LT((R * from.normalized() - to).norm(), 1e-14);
    EXPECT_NEAR(logSO3(R).norm(), angleBetween(from, to), 1e-14);
  }
  for (double angle :
       {1e-12, 1e-8, 1e-3, 1.57, 1.58, 3.0, M_PI - 1e-5, M_PI - 1e-9, M_PI - 1e-13}) {
    const Vector3d to = expSO3(angle * from.unitOrthogonal()) * from;
    const Matrix3d R = rotationBetween(from, to);
    EXPECT_LT((R * from - to).norm(), 1e-14 * from.norm()) << angle;
    EXPECT_NEAR(logSO3(R).norm(), angle, 1e-14);
    EXPECT_LT((R.transpose() * R - Matrix3d::Identity()).norm(), 1e-14);
  }
  const Matrix3d same = rotationBetween(from, 2.0 * from);
  EXPECT_LT((same - Matrix3d::Identity()).norm(), 1e-14);
  const Matrix3d opposite = rotationBetween(from, -from);
  EXPECT_LT((opposite * from + from).norm(), 1e-13);
  EXPECT_NEAR(opposite.determinant(), 1.0, 1e-14);
}

}  // namespace
}  // namespace etalon
