#include "etalon/odometry/stereo_visual_odometry.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"
#include "simulated_flight.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/** Exact tracks at 20 Hz and an exact IMU; keyframes at 4 Hz. */
class StereoVisual : public ::testing::Test {
 protected:
  static const SimulatedFlight& flight() {
    static const SimulatedFlight flight = [] {
      SimulatedFlightOptions options;
      options.duration_s = 5.0;
      options.sigma_px = 0.0;
      return simulateFlight(options);
    }();
    return flight;
  }
  StereoVisual() : odometry_(flight().calibration, {}, {}) {}

  OdometryOutput start() {
    OdometryStart start;
    start.state = flight().truth[0];
    return odometry_.start(start, flight().frames[0]);
  }
  OdometryOutput process(size_t k) {
    return odometry_.process(flight().frames[k], flight().between(k - 1, k));
  }
  OdometryOutput processBlind(size_t k) {
    TrackedFrame covered;
    covered.t = flight().frames[k].t;
    return odometry_.process(covered, flight().between(k - 1, k));
  }
  static double turn(const SE3& a, const SE3& b) { return logSO3(a.R.transpose() * b.R).norm(); }

  StereoVisualOdometry odometry_;
};

TEST_F(StereoVisual, FollowsTheImagesAndTellsThePoseAlone) {
  const NavState first = flight().truth[0];
  OdometryOutput out = start();
  EXPECT_TRUE(out.keyframe);
  EXPECT_FALSE(out.inertial);
  EXPECT_EQ(out.state.T_WB.t, first.T_WB.t);
  int keyframes = 1;
  for (size_t k = 1; k <= 60; ++k) {
    out = process(k);
    keyframes += out.keyframe;
    EXPECT_FALSE(out.inertial);
    EXPECT_FALSE(out.imu_missing);
    EXPECT_EQ(out.unlocated_s, 0.0);
    EXPECT_GT(out.used, 50);
    EXPECT_LE(out.used, out.observations);
    ASSERT_LT((out.state.T_WB.t - flight().truth[k].T_WB.t).norm(), 1e-3) << k;
    ASSERT_LT(turn(out.state.T_WB, flight().truth[k].T_WB), 1e-3) << k;
    EXPECT_LT((out.state.v_WB - flight().truth[k].v_WB).norm(), 0.2) << k;
    EXPECT_EQ(out.state.bias.gyro, first.bias.gyro);
    EXPECT_EQ(out.state.bias.accel, first.bias.accel);
  }
  EXPECT_EQ(keyframes, 13);  // three seconds
  EXPECT_EQ(odometry_.keyframes().size(), 10U);
  EXPECT_EQ(odometry_.keyframes().back().t, flight().frames[60].t);
  EXPECT_GT(odometry_.landmarks().size(), 50U);
}

TEST_F(StereoVisual, WithoutObservationsTheGyroTurnsAndTheVelocityMovesThePose) {
  start();
  size_t k = 1;
  for (; k <= 20; ++k) process(k);
  const size_t landmarks = odometry_.landmarks().size();
  for (; k <= 30; ++k) {
    const OdometryOutput out = processBlind(k);
    EXPECT_FALSE(out.keyframe);
    EXPECT_EQ(out.used, 0);
    EXPECT_NEAR(out.unlocated_s, 0.05 * static_cast<double>(k - 20), 1e-6);
    EXPECT_LT(turn(out.state.T_WB, flight().truth[k].T_WB), 2e-3) << k;  // the gyro's noise
    EXPECT_LT((out.state.T_WB.t - flight().truth[k].T_WB.t).norm(), 0.5) << k;
  }
  // The landmarks have waited: whoever shows them again is located among them.
  EXPECT_EQ(odometry_.landmarks().size(), landmarks);
  TrackedFrame again = flight().frames[20];
  again.t = flight().frames[31].t;
  const OdometryOutput out = odometry_.process(again, {});
  EXPECT_TRUE(out.imu_missing);
  // So is a gap within the interval.
  TrackedFrame next = flight().frames[20];
  next.t = flight().frames[32].t;
  std::vector<ImuSample> gap = flight().between(31, 32);
  EXPECT_FALSE(gap.empty());
  gap.erase(gap.begin() + 1, gap.end() - 1);
  EXPECT_TRUE(odometry_.process(next, gap).imu_missing);
  EXPECT_EQ(out.unlocated_s, 0.0);
  EXPECT_LT((out.state.T_WB.t - flight().truth[20].T_WB.t).norm(), 1e-3);
}

TEST_F(StereoVisual, BeginsWithTheLandmarksOfTheStartAndAnewWhenItIsStartedAgain) {
  start();
  for (size_t k = 1; k <= 7; ++k) process(k);
  OdometryStart start;
  start.state = flight().truth[8];
  const LandmarkId known = flight().frames[8].observations[0].id;
  start.landmarks[known] = Vector3d(7, 8, 9);
  const OdometryOutput out = odometry_.start(start, flight().frames[8]);
  EXPECT_TRUE(out.keyframe);
  EXPECT_EQ(odometry_.landmarks().at(known), Vector3d(7, 8, 9));
  ASSERT_EQ(odometry_.keyframes().size(), 1U);
  EXPECT_EQ(odometry_.keyframes()[0].t, flight().frames[8].t);
  for (size_t k = 9; k < 13; ++k) EXPECT_FALSE(process(k).keyframe) << k;
  EXPECT_TRUE(process(13).keyframe);  // a quarter of a second after the new start
}

}  // namespace
}  // namespace etalon
