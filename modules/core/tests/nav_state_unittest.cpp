// States and rigid transforms: what everything else counts on.

#include "etalon/core/nav_state.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "etalon/core/so3.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using Vector15d = Eigen::Matrix<double, 15, 1>;

NavState someState() {
  return {{expSO3({0.4, -1.3, 0.8}), {1.0, -2.0, 3.0}},
          {0.5, 0.6, -0.7},
          {{0.01, 0.02, 0.03}, {0.1, -0.2, 0.3}}};
}

TEST(NavState, MovesEveryPartByItsOwnBlock) {
  const NavState state = someState();
  Vector15d d;
  for (int i = 0; i < 15; ++i) d[i] = 0.1 * (i + 1);
  const NavState moved = state.plus(d);
  // The rotation is moved in the body's axes, everything else in its own.
  EXPECT_LT((moved.T_WB.R - state.T_WB.R * expSO3({0.1, 0.2, 0.3})).norm(), 1e-14);
  EXPECT_LT((moved.T_WB.t - state.T_WB.t - Vector3d(0.4, 0.5, 0.6)).norm(), 1e-14);
  EXPECT_LT((moved.v_WB - state.v_WB - Vector3d(0.7, 0.8, 0.9)).norm(), 1e-14);
  EXPECT_LT((moved.bias.gyro - state.bias.gyro - Vector3d(1.0, 1.1, 1.2)).norm(), 1e-14);
  EXPECT_LT((moved.bias.accel - state.bias.accel - Vector3d(1.3, 1.4, 1.5)).norm(), 1e-14);
  EXPECT_EQ(state_index::kRotation, 0);
  EXPECT_EQ(state_index::kPosition, 3);
  EXPECT_EQ(state_index::kVelocity, 6);
  EXPECT_EQ(state_index::kGyroBias, 9);
  EXPECT_EQ(state_index::kAccelBias, 12);
}

TEST(NavState, TheDifferenceIsTheErrorThatMovesOneToTheOther) {
  const NavState a = someState();
  for (const double size : {0.0, 1e-9, 0.1, 1.7}) {  // rotations up to 2.9 rad
    Vector15d d = size * Vector15d::LinSpaced(-1.0, 1.0);
    EXPECT_LT((a.plus(d).minus(a) - d).norm(), 1e-12 * (1.0 + size)) << size;
    // Back by the opposite error.
    EXPECT_LT(a.plus(d).plus(-d).minus(a).norm(), 1e-12 * (1.0 + size)) << size;
  }
  EXPECT_EQ(a.minus(a).tail<12>(), Vector15d::Zero().tail<12>());
}

TEST(NavState, ItsErrorHasTheDerivativeOfTheLogarithm) {
  const NavState a = someState();
  const Vector15d d = 0.3 * Vector15d::LinSpaced(-1.0, 1.0);
  Eigen::Matrix<double, 15, 15> J = Eigen::Matrix<double, 15, 15>::Identity();
  J.topLeftCorner<3, 3>() = rightJacobianInverseSO3(Vector3d(d.head<3>()));
  testing::expectJacobian(
      J, [&](const Vector15d& e) { return a.plus(d).plus(e).minus(a); },
      Vector15d(Vector15d::Zero()));
}

TEST(StampedState, KeepsItsParts) {
  const StampedState stamped(77, someState());
  EXPECT_EQ(stamped.t, 77);
  EXPECT_EQ(stamped.minus(someState()).tail<12>(), Vector15d::Zero().tail<12>());
  const StampedState pose(5, someState().T_WB);
  EXPECT_EQ(pose.v_WB, Vector3d::Zero());
  EXPECT_EQ(pose.bias.gyro, Vector3d::Zero());
}

TEST(SE3, IsTheProductOfHomogeneousMatrices) {
  const SE3 A(expSO3({0.3, 0.2, -0.9}), {1.0, 2.0, 3.0}), B(expSO3({-1.0, 0.4, 0.1}), {0, -1, 5});
  EXPECT_LT(((A * B).matrix() - A.matrix() * B.matrix()).norm(), 1e-14);
  EXPECT_LT((A.inverse().matrix() - A.matrix().inverse()).norm(), 1e-14);
  const Vector3d p(0.5, -0.6, 0.7);
  EXPECT_LT((A * p - (A.matrix() * p.homogeneous()).head<3>()).norm(), 1e-14);
  EXPECT_LT((A.inverse() * (A * p) - p).norm(), 1e-14);
  EXPECT_EQ(SE3().matrix(), Eigen::Matrix4d::Identity());
}

}  // namespace
}  // namespace etalon
