// What makes a flight survive or fail, in words, and the errors after its start.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "etalon/core/so3.h"
#include "trial/trial_flight.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr TimeNs kStep = 50'000'000;

/** Twelve seconds at 20 Hz, from which no pose differs but by the choice of the world. */
class TrialJudgement : public ::testing::Test {
 protected:
  TrialJudgement() {
    truth_.has_velocity = true;
    for (int k = 0; k <= 240; ++k) {
      StampedState state;
      state.t = kStep * k;
      const double s = 0.05 * k;
      state.T_WB = {expSO3({0.0, 0.0, 0.2 * s}), {std::sin(s), std::cos(s), 0.1 * s}};
      state.v_WB = {std::cos(s), -std::sin(s), 0.1};
      truth_.states.push_back(state);
      FrameEstimate estimate;
      estimate.t = state.t;
      const SE3 T_WG(expSO3({0.0, 0.0, 0.7}), {1.0, 2.0, 3.0});
      estimate.nav = state;
      estimate.nav.T_WB = T_WG * state.T_WB;
      estimate.nav.v_WB = T_WG.R * state.v_WB;
      if (k >= 20) {
        estimate.state = PipelineState::kInertial;
        estimate.pose_covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-4;
        estimate.motion_variance.setConstant(1e-4);
      }
      flown_.images.push_back(state.t);
      flown_.estimates.push_back(estimate);
    }
    flown_.started = kStep * 20;
    flown_.end_state = "inertial";
  }

  void faultAt(double s) { flown_.fault_at = durationNs(s); }
  void event(double s, PipelineState state, bool remark = false) {
    PipelineEvent event;
    event.t = durationNs(s);
    event.state = state;
    event.reason = "of a reason";
    event.remark = remark;
    flown_.events.push_back(event);
  }
  /** Moves the estimates from `from_s` on. */
  void moveFrom(double from_s, double metres) {
    for (FrameEstimate& e : flown_.estimates)
      if (e.t >= durationNs(from_s)) e.nav.T_WB.t.x() += metres;
  }

  TrialRun judged() {
    flown_.causal = trajectoryOf(flown_.estimates);
    if (flown_.smoothed.empty()) flown_.smoothed = flown_.causal;
    TrialRun run;
    judge(flown_, truth_, protocol_, &run);
    return run;
  }

  GroundTruth truth_;
  Flown flown_;
  TrialProtocol protocol_;
};

TEST_F(TrialJudgement, AGoodFlightSurvives) {
  event(1.0, PipelineState::kInertial);
  const TrialRun run = judged();
  EXPECT_EQ(run.status, kStatusSurvived) << run.reason;
  EXPECT_EQ(run.reason, "");
  EXPECT_EQ(run.event, "");  // a start is no news
  EXPECT_EQ(run.frames, 241);
  EXPECT_EQ(run.poses, 241);
  EXPECT_NEAR(run.seconds, 12.0, 1e-9);
  EXPECT_NEAR(run.started_s, 1.0, 1e-9);
  EXPECT_LT(run.causal.ate_m, 1e-9);
  EXPECT_LT(run.causal.rpe_m, 1e-9);
  EXPECT_LT(run.causal.rotation_deg, 1e-5);
  EXPECT_LT(run.error_over_predicted, 1e-6);
  EXPECT_EQ(run.lost_s, 0.0);
}

TEST_F(TrialJudgement, ErrorsCountFromTheStart) {
  moveFrom(7.0, 0.03);
  const TrialRun run = judged();
  ASSERT_EQ(run.after_start.size(), 4U);
  EXPECT_LT(run.after_start[0].ate_m, 1e-9);  // 1 s
  EXPECT_LT(run.after_start[1].ate_m, 1e-9);  // 5 s: to 6.0 s
  EXPECT_GT(run.after_start[2].ate_m, 0.005);
  EXPECT_GT(run.after_start[3].ate_m, run.after_start[2].ate_m);
  EXPECT_LT(run.after_start[3].velocity_mps, 1e-9);
  EXPECT_LT(run.after_start[3].tilt_deg, 1e-6);
  // 3 cm in five of eleven seconds, 1 cm an axis predicted.
  EXPECT_NEAR(run.error_over_predicted, 0.03 * std::sqrt(101.0 / 221.0) / (0.01 * std::sqrt(3.0)),
              1e-6);
}

TEST_F(TrialJudgement, RpeIsOverASecondWhereverPosesAreMissing) {
  for (FrameEstimate& e : flown_.estimates) e.nav.T_WB.t.x() += 0.01 * 1e-9 * e.t;  // 1 cm a second
  const std::vector<FrameEstimate> all = flown_.estimates;
  const auto rpe = [&](const std::function<bool(size_t)>& isThere) {
    flown_.estimates.clear();
    flown_.smoothed.clear();
    for (size_t i = 0; i < all.size(); ++i)
      if (isThere(i)) flown_.estimates.push_back(all[i]);
    return judged().causal.rpe_m;
  };
  // The tolerance is for rounding alone.
  EXPECT_NEAR(rpe([](size_t) { return true; }), 0.01, 1e-9);
  EXPECT_NEAR(rpe([](size_t i) { return i % 2 == 0; }), 0.01, 1e-9);
  EXPECT_NEAR(rpe([](size_t i) { return i < 110 || i > 150; }), 0.01, 1e-9);  // a gap of 2 s
  EXPECT_TRUE(std::isnan(rpe([](size_t i) { return i < 20; })));              // 0.95 s in all
}

TEST_F(TrialJudgement, WhatHasNotLastedHasNoErrors) {
  flown_.started = durationNs(4.0);
  const TrialRun run = judged();
  EXPECT_LT(run.after_start[1].ate_m, 1e-9);
  EXPECT_TRUE(std::isnan(run.after_start[2].ate_m));  // ten seconds would end at 14 s
  EXPECT_LT(run.after_start[3].ate_m, 1e-9);
}

TEST_F(TrialJudgement, AnAteBeyondTheLimitIsAFailure) {
  moveFrom(6.0, 1.5);
  event(6.0, PipelineState::kDeadReckoning);
  const TrialRun run = judged();
  EXPECT_EQ(run.status, kStatusFailed);
  EXPECT_THAT(run.reason, AllOf(StartsWith("ATE 0."), HasSubstr("more than 0.5 m")));
  EXPECT_FALSE(run.silent);
  EXPECT_EQ(run.event, "at 6.00 s dead_reckoning: of a reason");
}

TEST_F(TrialJudgement, BeingWrongWithoutAWordIsSilent) {
  moveFrom(6.0, 0.2);  // 11.5 times the predicted 1.7 cm, an ATE within the limit
  faultAt(5.0);
  TrialRun run = judged();
  EXPECT_TRUE(run.silent);
  EXPECT_EQ(run.reason, "silent: off by 0.20 m at 6.00 s, 12 times the predicted 0.017 m");
  event(4.0, PipelineState::kDeadReckoning);  // before the fault: says nothing of it
  EXPECT_TRUE(judged().silent);
  event(5.5, PipelineState::kInertial, true);
  run = judged();
  EXPECT_FALSE(run.silent);
  EXPECT_TRUE(run.survived());
  EXPECT_THAT(run.event, StartsWith("at 5.50 s"));
}

TEST_F(TrialJudgement, AMissingPoseIsNoGoodPose) {
  faultAt(5.0);
  flown_.estimates.erase(flown_.estimates.begin() + 150);
  TrialRun run = judged();
  EXPECT_EQ(run.reason, "no pose for 1 of 141 frames since the fault");
  EXPECT_NEAR(run.coverage(), 240.0 / 241.0, 1e-12);
  flown_.estimates.resize(100);
  EXPECT_THAT(judged().reason, StartsWith("poses for 100 of 241 frames"));
}

TEST_F(TrialJudgement, AMissingPoseBeforeTheFaultIsCountedAlone) {
  faultAt(5.0);
  flown_.estimates.erase(flown_.estimates.begin() + 50);
  const TrialRun run = judged();
  EXPECT_TRUE(run.survived()) << run.reason;
  EXPECT_LT(run.coverage(), 1.0);
}

TEST_F(TrialJudgement, EndingLostIsAFailure) {
  event(9.0, PipelineState::kLost);
  for (size_t i = 180; i < flown_.estimates.size(); ++i)
    flown_.estimates[i].state = PipelineState::kLost;
  flown_.end_state = "lost";
  const TrialRun run = judged();
  EXPECT_EQ(run.reason, "lost since 9.00 s: of a reason");
  EXPECT_NEAR(run.lost_s, 3.05, 1e-9);
}

TEST_F(TrialJudgement, AFlightThatNeverStartedSaysWhy) {
  flown_.started.reset();
  flown_.refusal = "too little parallax";
  for (FrameEstimate& e : flown_.estimates) {
    e.state = PipelineState::kVisual;
    e.pose_covariance.setConstant(FrameEstimate::kUnknown);
  }
  const TrialRun run = judged();
  EXPECT_EQ(run.reason, "never started, the last attempt: too little parallax");
  EXPECT_TRUE(std::isnan(run.started_s));
  EXPECT_TRUE(std::isnan(run.after_start.back().ate_m));
}

TEST_F(TrialJudgement, WithoutGroundTruthTheRestIsJudged) {
  truth_ = GroundTruth();
  moveFrom(6.0, 5.0);
  TrialRun run = judged();
  EXPECT_EQ(run.status, kStatusNotJudged);
  EXPECT_EQ(run.reason, "there is no ground truth");
  EXPECT_FALSE(run.survived() || run.judged());
  EXPECT_TRUE(std::isnan(run.causal.ate_m));
  flown_.end_state = "lost";
  run = judged();
  EXPECT_EQ(run.status, kStatusFailed);
  EXPECT_EQ(run.reason, "lost");
}

TEST_F(TrialJudgement, GroundTruthOnAnotherClockJudgesNothing) {
  for (StampedState& state : truth_.states) state.t += durationNs(1000.0);
  const TrialRun run = judged();
  EXPECT_EQ(run.status, kStatusNotJudged);
  EXPECT_EQ(run.reason, "ground truth covers 0 of 241 poses");
}

TEST_F(TrialJudgement, AFaultThatWasNotMetDoesNotCount) {
  TrialRun run = judged();
  setFaultNotMet(&run);
  EXPECT_EQ(run.status, kStatusFaultNotMet);
  EXPECT_FALSE(run.judged());
  run.status = kStatusCrashed;
  setFaultNotMet(&run);
  EXPECT_EQ(run.status, kStatusCrashed);
}

TEST_F(TrialJudgement, PosesOfASystemBelongToTheNearestFrame) {
  Trajectory trajectory;
  for (int k = 40; k <= 240; ++k) {
    if (k % 2 == 0) trajectory.push_back({kStep * k + 2'000'000, truth_.states[k].T_WB});
    if (k == 100) trajectory.push_back({kStep * k + 9'000'000, truth_.states[0].T_WB});
  }
  const Flown flown = flownBySystem(trajectory, flown_.images, durationNs(5.0));
  EXPECT_EQ(flown.causal.size(), 101U);
  EXPECT_EQ(flown.started, kStep * 40 + 2'000'000);
  TrialRun run;
  judge(flown, truth_, protocol_, &run);
  EXPECT_EQ(run.poses, 101);
  EXPECT_NEAR(run.started_s, 2.002, 1e-9);
  EXPECT_THAT(run.reason, StartsWith("poses for 101 of 241 frames"));  // every second frame
  EXPECT_EQ(run.end_state, "");
  EXPECT_TRUE(std::isnan(run.lost_s));
  EXPECT_LT(run.causal.ate_m, 0.01);
}

TEST_F(TrialJudgement, ASystemOnAnotherClockIsToldSo) {
  Trajectory trajectory = {{durationNs(1000.0), SE3()}, {durationNs(1001.0), SE3()}};
  TrialRun run;
  judge(flownBySystem(trajectory, flown_.images, std::nullopt), truth_, protocol_, &run);
  EXPECT_EQ(run.status, kStatusFailed);
  EXPECT_EQ(run.reason,
            "none of its 2 poses lies within half a frame of an image; is it on the "
            "same clock?");
}

TEST_F(TrialJudgement, ASystemWithoutPosesNeverStarted) {
  const Flown flown = flownBySystem({}, flown_.images, std::nullopt);
  TrialRun run;
  judge(flown, truth_, protocol_, &run);
  EXPECT_EQ(run.status, kStatusFailed);
  EXPECT_EQ(run.reason, "never started");
  EXPECT_EQ(run.coverage(), 0.0);
}

}  // namespace
}  // namespace etalon
