#include "etalon/core/angles.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d aboutZ(double angle) { return expSO3(Vector3d(0, 0, angle)); }

TEST(AligningYaw, TurnsBackWhatWasTurned) {
  for (const double yaw : {-3.0, -0.5, 0.0, 1e-9, 2.0}) {
    EXPECT_NEAR(aligningYaw(aboutZ(yaw)), yaw, 1e-15);
    Matrix3d sum = Matrix3d::Zero();  // their heights do not matter
    for (const Vector3d& v : {Vector3d(1, 2, 3), Vector3d(-2, 1, 5)})
      sum += (aboutZ(yaw) * v + Vector3d(0, 0, 4)) * v.transpose();
    EXPECT_NEAR(aligningYaw(sum), yaw, 1e-14);
  }
}

TEST(AligningYaw, IsTheBestTurnWhereATiltLeavesNoneThatIsExact) {
  const Matrix3d R = expSO3(Vector3d(0.3, -0.2, 1.0));
  const auto trace = [&R](double angle) { return (aboutZ(angle).transpose() * R).trace(); };
  const double best = aligningYaw(R);
  for (const double step : {1e-3, 0.1, 1.0}) {
    EXPECT_GT(trace(best), trace(best + step));
    EXPECT_GT(trace(best), trace(best - step));
  }
}

}  // namespace
}  // namespace etalon
