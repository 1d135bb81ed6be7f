#include "etalon/pipeline/odometry_start.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {
namespace {

using Eigen::Vector3d;

TEST(OdometryStart, IsMovedFromTheImageToItsStamp) {
  const Flight& flight = Flight::instance();
  for (const double offset_s : {-0.02, 0.01}) {
    const TimeNs t = flight.frames[3].t, taken = t + durationNs(offset_s);
    const auto at = flight.trajectory.at(taken), truth = flight.trajectory.at(t);
    OdometryStart start;
    start.state = {at.T_WB, at.v_WB, ImuBias()};
    const ImuBuffer imu(flight.imu);
    moveToStamp(offset_s, imu.between(std::min(t, taken), std::max(t, taken)), 9.81, &start);
    EXPECT_EQ(start.time_offset_s, offset_s);
    // Of the third order in the offset.
    EXPECT_LT((start.state.T_WB.t - truth.T_WB.t).norm(), 1e-4);
    EXPECT_LT((start.state.v_WB - truth.v_WB).norm(), 1e-2);
    EXPECT_LT(logSO3(start.state.T_WB.R.transpose() * truth.T_WB.R).norm(), 1e-3);
  }
}

TEST(OdometryStart, IsTheFirstKeyframeTurnedWithTheWorldAndKnowsLittleButYawAndPosition) {
  Initialization init;
  init.states = {
      {7, SE3(expSO3(Vector3d(0.1, 0.2, 0.3)), Vector3d(1, 2, 3)), Vector3d(0.5, -0.5, 0.25)},
      {8, SE3(), Vector3d::Zero()}};
  init.bias = {Vector3d(1, 2, 3) * 1e-3, Vector3d(4, 5, 6) * 1e-2};
  InitializationAttempt attempt;
  attempt.init = init;
  attempt.landmarks[5] = Vector3d(1, 2, 3);
  const SE3 T_WA(expSO3(Vector3d(0, 0, M_PI / 2)), Vector3d(10, 0, 0));
  const OdometryStart start = odometryStart(attempt, T_WA, BiasPriors());
  EXPECT_LT((start.state.T_WB.t - Vector3d(8, 1, 3)).norm(), 1e-12);
  EXPECT_LT((start.state.v_WB - Vector3d(0.5, 0.5, 0.25)).norm(), 1e-12);
  EXPECT_EQ(start.state.bias.gyro, init.bias.gyro);
  ASSERT_EQ(start.landmarks.size(), 1U);
  EXPECT_LT((start.landmarks.at(5) - Vector3d(8, 1, 3)).norm(), 1e-12);
  const auto& P = start.covariance;
  EXPECT_NEAR(P(6, 6), 0.01, 1e-12);
  EXPECT_NEAR(P(9, 9), 4e-4, 1e-12);
  EXPECT_NEAR(P(14, 14), 0.01, 1e-12);
  BiasPriors device;
  device.sigma_gyro_rps = 2e-3;
  device.sigma_accel_mps2 = 2e-2;
  EXPECT_NEAR(odometryStart(attempt, T_WA, device).covariance(9, 9), 4e-6, 1e-12);
  EXPECT_NEAR(odometryStart(attempt, T_WA, device).covariance(14, 14), 4e-4, 1e-12);
  // Tilt about the world's x and y, next to nothing about its z: seen in the body.
  const Eigen::Matrix3d R = start.state.T_WB.R;
  const Eigen::Matrix3d in_world = R * P.topLeftCorner<3, 3>() * R.transpose();
  EXPECT_LT((in_world - Eigen::Matrix3d(Vector3d(9e-4, 9e-4, 1e-8).asDiagonal())).norm(), 1e-12);
}

}  // namespace
}  // namespace etalon::pipeline_test
