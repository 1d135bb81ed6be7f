#include "etalon/core/yaw.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(AligningYaw, TurnsBackWhatWasTurned) {
  for (const double yaw : {-3.0, -0.5, 0.0, 1e-9, 2.0}) {
    EXPECT_NEAR(aligningYaw(turnAboutZ(yaw)), yaw, 1e-15);
    Matrix3d sum = Matrix3d::Zero();  // their heights do not matter
    for (const Vector3d& v : {Vector3d(1, 2, 3), Vector3d(-2, 1, 5)})
      sum += (turnAboutZ(yaw) * v + Vector3d(0, 0, 4)) * v.transpose();
    EXPECT_NEAR(aligningYaw(sum), yaw, 1e-14);
  }
}

TEST(AligningYaw, IsTheBestTurnWhereATiltLeavesNoneThatIsExact) {
  const Matrix3d R = expSO3(Vector3d(0.3, -0.2, 1.0));
  const auto trace = [&R](double angle) { return (turnAboutZ(angle).transpose() * R).trace(); };
  const double best = aligningYaw(R);
  for (const double step : {1e-3, 0.1, 1.0}) {
    EXPECT_GT(trace(best), trace(best + step));
    EXPECT_GT(trace(best), trace(best - step));
  }
}

TEST(YawPositionAlignment, TakesOnePoseToTheOther) {
  const SE3 T_GB(expSO3(Vector3d(0.3, -0.2, 1.0)), Vector3d(1, -2, 3));
  const SE3 T_WG(turnAboutZ(2.5), Vector3d(-4, 0.5, 7));
  const SE3 found = yawPositionAlignment(T_GB, T_WG * T_GB);
  EXPECT_TRUE(found.matrix().isApprox(T_WG.matrix(), 1e-14));
}

TEST(YawPositionAlignment, KeepsThePositionWhereThePosesDifferInTilt) {
  const SE3 T_GB(Matrix3d::Identity(), Vector3d(1, 2, 3));
  const SE3 T_WB(expSO3(Vector3d(0.1, 0, 0)) * turnAboutZ(0.7), Vector3d(5, 6, 7));
  const SE3 T_WG = yawPositionAlignment(T_GB, T_WB);
  EXPECT_TRUE((T_WG * T_GB.t).isApprox(T_WB.t, 1e-14));
  EXPECT_EQ(T_WG.R.row(2), Eigen::RowVector3d(0, 0, 1));
}

}  // namespace
}  // namespace etalon
