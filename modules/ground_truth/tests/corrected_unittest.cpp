#include "corrected.h"

#include <gtest/gtest.h>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon::ground_truth {
namespace {

/** True states every quarter of a second, in a world tilted by two degrees. */
class TrueNodes : public ::testing::Test {
 protected:
  TrueNodes() : flight_(options()) {
    imu_ = ImuBuffer(synthesizeImu(flight_, flight_.start(), flight_.end(),
                                   ImuSynthesisOptions::noiseFree(100.0))
                         .samples);
    shared_.g_G = R_GW_ * Eigen::Vector3d(0.0, 0.0, -9.81);
    for (int k = 0; k < 20; ++k) {
      // Off the IMU's stamps, but for the first.
      const TimeNs t = flight_.start() + durationNs(0.257 * k);
      const TrajectoryState at = flight_.at(t);
      Node node;
      node.body = StampedState(t, SE3(R_GW_ * at.T_WB.R, R_GW_ * at.T_WB.t), R_GW_ * at.v_WB);
      nodes_.push_back(node);
    }
  }
  static ProfileOptions options() {
    ProfileOptions options;
    options.profile = MotionProfile::kAggressive;
    options.duration_s = 6.0;
    return options;
  }

  ProfileTrajectory flight_;
  ImuBuffer imu_;
  Eigen::Matrix3d R_GW_ = expSO3(Eigen::Vector3d(radians(2.0), 0.0, 0.0));
  Shared shared_;
  std::vector<Node> nodes_;
};

TEST_F(TrueNodes, StatesStandAtTheImusStamps) {
  const GroundTruth truth = correctedStates(nodes_, shared_, imu_, 1.0);
  EXPECT_TRUE(truth.has_velocity);
  EXPECT_TRUE(truth.has_biases);
  // From the first node to the last: 19 * 0.257 s at 100 Hz.
  ASSERT_EQ(truth.states.size(), 489u);
  for (size_t i = 0; i < truth.states.size(); ++i)
    EXPECT_EQ(truth.states[i].t, imu_.samples()[i].t);
}

TEST_F(TrueNodes, TheyAreTheFlight) {
  // The world's tilt is about x: taken out, W is the flight's own.
  for (const StampedState& state : correctedStates(nodes_, shared_, imu_, 1.0).states) {
    const TrajectoryState at = flight_.at(state.t);
    // The midpoint rule at 100 Hz over a quarter of a second.
    EXPECT_LT((state.T_WB.t - at.T_WB.t).norm(), 1e-4);
    EXPECT_LT((state.v_WB - at.v_WB).norm(), 2e-3);
    EXPECT_LT(angleBetween(Eigen::Vector3d(state.T_WB.R.row(2)), Eigen::Vector3d(at.T_WB.R.row(2))),
              radians(0.02));
  }
}

TEST_F(TrueNodes, WhatTheImuMissesIsSpread) {
  for (size_t k = 10; k < nodes_.size(); ++k) nodes_[k].body.T_WB.t.x() += 0.1;
  const GroundTruth truth = correctedStates(nodes_, shared_, imu_, 1.0);
  const auto missed = [&](double s) {
    const TimeNs t = flight_.start() + durationNs(s);
    return truth.at(t)->T_WB.t.x() - flight_.at(t).T_WB.t.x();
  };
  EXPECT_NEAR(missed(9.0 * 0.257), 0.0, 2e-3);
  EXPECT_NEAR(missed(9.5 * 0.257), 0.05, 2e-3);
  EXPECT_NEAR(missed(10.0 * 0.257), 0.1, 2e-3);
}

TEST_F(TrueNodes, LongGapsStayGaps) {
  nodes_.erase(nodes_.begin() + 8, nodes_.begin() + 12);  // 1.3 s
  const TimeNs middle = flight_.start() + durationNs(9.5 * 0.257);
  const auto nearest = [&](const GroundTruth& truth) {
    double best = 1e9;
    for (const StampedState& state : truth.states)
      best = std::min(best, std::abs(secondsBetween(middle, state.t)));
    return best;
  };
  EXPECT_GT(nearest(correctedStates(nodes_, shared_, imu_, 1.0)), 0.5);
  EXPECT_LT(nearest(correctedStates(nodes_, shared_, imu_, 1.5)), 0.01);
}

}  // namespace
}  // namespace etalon::ground_truth
