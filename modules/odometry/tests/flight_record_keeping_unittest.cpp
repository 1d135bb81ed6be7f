// What a flight's record keeps, replaces and forgets, told by an odometry that says what it is told.

#include <gtest/gtest.h>

#include "etalon/odometry/flight_record.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr TimeNs kStep = 50'000'000, kStampsAhead = 7'000'000'000;

SE3 at(double x) { return {Eigen::Matrix3d::Identity(), {x, 0.0, 0.0}}; }

class ToldOdometry : public Odometry {
 public:
  OdometryOutput start(const OdometryStart&, const TrackedFrame&) override { return {}; }
  OdometryOutput process(const TrackedFrame&, const std::vector<ImuSample>&) override { return {}; }
  Trajectory keyframes() const override { return keyframes_; }
  std::map<LandmarkId, Vector3d> landmarks() const override { return landmarks_; }

  Trajectory keyframes_;
  std::map<LandmarkId, Vector3d> landmarks_;
};

class RecordKeeping : public ::testing::Test {
 protected:
  /** The frame of that number, whose stamp is not the odometry's time. */
  void add(int number, bool keyframe, const Odometry* odometry, size_t samples = 11,
           bool previous_keyframe = false) {
    TrackedFrame frame;
    frame.t = number * kStep;
    std::vector<ImuSample> imu(samples);
    for (size_t i = 0; i < samples; ++i)
      imu[i].t = frame.t - kStep + kStep / 10 * static_cast<TimeNs>(i);
    OdometryOutput output;
    output.t = frame.t;
    output.keyframe = keyframe;
    output.previous_keyframe = previous_keyframe;
    output.state.T_WB = at(number);
    record_.add(frame.t + kStampsAhead, frame, imu, output, odometry);
  }
  std::vector<double> positions() const {
    std::vector<double> positions;
    for (const StampedPose& pose : record_.smoothed()) positions.push_back(pose.T_WB.t.x());
    return positions;
  }

  FlightRecord record_{eurocCalibration(), FlightRecordOptions()};
};

TEST_F(RecordKeeping, KeyframesAreRememberedByTheirStampsAndCorrectedByTheOdometrysTime) {
  ToldOdometry odometry;
  for (int k = 0; k < 6; ++k) add(k, k % 2 == 0, nullptr);
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 2.0, 4.0}));
  EXPECT_EQ(record_.smoothed()[1].t, 2 * kStep + kStampsAhead);
  // It knows better of frames 2 and 4; of frame 3, which was no keyframe, nobody asked.
  odometry.keyframes_ = {{2 * kStep, at(2.5)}, {3 * kStep, at(99.0)}, {4 * kStep, at(4.5)}};
  add(6, false, &odometry);
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 2.5, 4.5}));
  EXPECT_EQ(record_.smoothed()[2].t, 4 * kStep + kStampsAhead);
  // What left its window keeps the last estimate.
  odometry.keyframes_ = {{4 * kStep, at(4.75)}};
  add(7, false, &odometry);
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 2.5, 4.75}));
}

TEST_F(RecordKeeping, AFrameMayBecomeAKeyframeOneFrameLater) {
  add(0, true, nullptr);
  for (int k = 1; k < 4; ++k) add(k, false, nullptr);
  add(4, false, nullptr, 11, true);
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 3.0}));
  add(5, true, nullptr);
  add(6, true, nullptr, 11, true);  // 5 is one already
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 3.0, 5.0, 6.0}));
}

TEST_F(RecordKeeping, WhatCameSinceTheLastLossMovesWithTheWorld) {
  ToldOdometry before, after;
  before.landmarks_ = {{1, Vector3d(1, 0, 0)}, {2, Vector3d(2, 0, 0)}};
  after.landmarks_ = {{3, Vector3d(3, 0, 0)}};
  for (int k = 0; k < 3; ++k) add(k, true, &before);
  record_.interrupt();
  for (int k = 3; k < 5; ++k) add(k, true, &after);
  record_.moveWorld(at(100.0));
  EXPECT_EQ(positions(), (std::vector<double>{0.0, 1.0, 2.0, 103.0, 104.0}));
  EXPECT_EQ(record_.landmarks().at(2), Vector3d(2, 0, 0));
  EXPECT_EQ(record_.landmarks().at(3), Vector3d(103, 0, 0));
  add(5, true, nullptr);  // by the odometry, whose world has moved, too
  EXPECT_EQ(positions().back(), 5.0);
}

TEST_F(RecordKeeping, LandmarksAreTakenAtKeyframesAndStayWhereTheyWereLastKnown) {
  ToldOdometry odometry;
  odometry.landmarks_ = {{1, Vector3d(1, 1, 1)}, {2, Vector3d(2, 2, 2)}};
  add(0, false, &odometry);
  EXPECT_TRUE(record_.landmarks().empty());
  add(1, true, &odometry);
  odometry.landmarks_ = {{2, Vector3d(3, 3, 3)}, {3, Vector3d(4, 4, 4)}};
  add(2, true, &odometry);
  ASSERT_EQ(record_.landmarks().size(), 3U);
  EXPECT_EQ(record_.landmarks().at(1), Vector3d(1, 1, 1));
  EXPECT_EQ(record_.landmarks().at(2), Vector3d(3, 3, 3));
  odometry.landmarks_.clear();
  for (LandmarkId id = 10; id < 10 + static_cast<LandmarkId>(FlightRecord::kMostLandmarks); ++id)
    odometry.landmarks_.emplace_hint(odometry.landmarks_.end(), id, Vector3d::Zero());
  add(3, true, &odometry);
  EXPECT_EQ(record_.landmarks().size(), FlightRecord::kMostLandmarks);
  EXPECT_EQ(record_.landmarks().begin()->first, 10);  // the oldest have gone
}

TEST_F(RecordKeeping, OldPosesAreForgottenAndTheOthersStillCorrected) {
  ToldOdometry odometry;
  for (int k = 0; k < 6; ++k) add(k, true, nullptr);
  record_.forgetBefore(3 * kStep + kStampsAhead);
  EXPECT_EQ(positions(), (std::vector<double>{3.0, 4.0, 5.0}));
  record_.forgetBefore(3 * kStep + kStampsAhead);
  EXPECT_EQ(positions().size(), 3U);
  odometry.keyframes_ = {{2 * kStep, at(-1.0)}, {4 * kStep, at(4.5)}};
  add(6, false, &odometry);
  EXPECT_EQ(positions(), (std::vector<double>{3.0, 4.5, 5.0}));
  record_.forgetBefore(3 * kStep + kStampsAhead + 1);
  EXPECT_EQ(positions(), (std::vector<double>{4.5, 5.0}));
  record_.forgetBefore(100 * kStep + kStampsAhead);
  EXPECT_TRUE(positions().empty());
}

TEST_F(RecordKeeping, APlatformThatRestsHasAKeyframeOnceInAWhile) {
  // 2000 samples: frames bring ten new ones each (the first eleven).
  for (int k = 0; k < 200; ++k) add(k, k == 0, nullptr);
  EXPECT_EQ(positions(), (std::vector<double>{0.0}));
  for (int k = 200; k < 203; ++k) add(k, false, nullptr);
  ASSERT_EQ(positions().size(), 2U);
  EXPECT_NEAR(positions()[1], 200.0, 1.0);
  // An end of the odometry in between begins the count anew.
  record_.interrupt();
  for (int k = 203; k < 402; ++k) add(k, false, nullptr);
  EXPECT_EQ(positions().size(), 2U);
}

TEST_F(RecordKeeping, WithoutKeyframesToKeepThereIsNothingToAdjust) {
  for (int k = 0; k < 6; ++k) add(k, true, nullptr);
  EXPECT_EQ(positions().size(), 6U);
  EXPECT_TRUE(record_.finalBa({}).keyframes.empty());
}

}  // namespace
}  // namespace etalon
