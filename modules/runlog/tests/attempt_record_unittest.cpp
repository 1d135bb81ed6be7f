#include "etalon/runlog/attempt_record.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

/** Three keyframes; VI-BA halves the gyro bias's error. */
InitializationAttempt exampleAttempt() {
  InitializationAttempt attempt;
  attempt.init = Initialization();
  Initialization& init = *attempt.init;
  for (int k = 0; k < 3; ++k) {
    StampedState state;
    state.t = 1'000'000'000LL + 250'000'000LL * k;
    state.T_WB.t = Eigen::Vector3d(k, k * k, 0);
    attempt.keyframes.push_back(state.t);
    init.states.push_back(state);
    attempt.vi_ba.states.push_back(state);
  }
  attempt.t = attempt.keyframes.back();
  init.bias.gyro.x() = 0.02;
  init.covariance = Eigen::MatrixXd::Identity(11, 11);
  attempt.init_timings = {{"map", 1.5}};
  attempt.has_vi_ba = true;
  attempt.vi_ba.bias.gyro.x() = 0.01;
  attempt.decision = {};
  attempt.stereo_odometry_ms = 10.0;
  attempt.initialize_ms = 2.0;
  attempt.vi_ba_ms = 30.0;
  attempt.used_stereo_odometry = true;
  return attempt;
}

GroundTruth truthOf(const InitializationAttempt& attempt) {
  GroundTruth truth;
  truth.has_velocity = truth.has_biases = true;
  for (const StampedState& s : attempt.init->states) truth.states.push_back({s.t, s.T_WB});
  return truth;
}

TEST(AttemptRecord, HoldsBothStagesWithTheirErrors) {
  const InitializationAttempt attempt = exampleAttempt();
  const AttemptRecord record = makeAttemptRecord(attempt, 9.8, truthOf(attempt));
  EXPECT_TRUE(record.accepted());
  EXPECT_EQ(record.t, attempt.t);
  EXPECT_EQ(record.keyframes, attempt.keyframes);
  EXPECT_EQ(record.milliseconds(kTimingStereoOdometry), 10.0);
  EXPECT_EQ(record.milliseconds(kTimingInitialize), 2.0);
  EXPECT_EQ(record.milliseconds(kTimingViBa), 30.0);
  EXPECT_EQ(record.milliseconds("map"), 1.5);
  ASSERT_EQ(record.stages.size(), 2u);
  EXPECT_EQ(record.stages[0].stage, "init");
  EXPECT_EQ(record.stages[1].stage, "vi_ba");
  EXPECT_EQ(record.stages[0].gravity_B0, Eigen::Vector3d(0, 0, -9.8));
  EXPECT_EQ(record.stages[0].covariance.rows(), 11);
  EXPECT_FALSE(record.stages[0].covariance_order.empty());
  EXPECT_EQ(record.stages[1].covariance.size(), 0);
  EXPECT_EQ(record.stages[1].states[2].t, attempt.t);
  ASSERT_TRUE(record.stages[0].errors && record.stages[1].errors);
  EXPECT_DOUBLE_EQ(record.stages[0].errors->gyro_bias_rps, 0.02);
  EXPECT_DOUBLE_EQ(record.stages[1].errors->gyro_bias_rps, 0.01);
}

TEST(AttemptRecord, WithoutGroundTruthThereAreNoErrors) {
  const AttemptRecord record = makeAttemptRecord(exampleAttempt(), 9.81, {});
  ASSERT_EQ(record.stages.size(), 2u);
  EXPECT_FALSE(record.stages[0].errors.has_value());
}

TEST(AttemptRecord, ARefusalKeepsItsReason) {
  InitializationAttempt attempt;
  attempt.t = 5;
  attempt.decision =
      refuse(RefusalStatus::kTooLittleMotion, "moves by ", Value(0.1), ", at least ", Bound(0.5));
  const AttemptRecord record = makeAttemptRecord(attempt, 9.81, {});
  EXPECT_FALSE(record.accepted());
  EXPECT_EQ(record.status, "too_little_motion");
  EXPECT_EQ(record.reason, "moves by 0.1, at least 0.5");
  EXPECT_EQ(record.reason_value, 0.1);
  EXPECT_EQ(record.reason_bound, 0.5);
  EXPECT_TRUE(record.stages.empty());
}

TEST(AttemptRecord, PassesTheDirectionOfGravityOn) {
  const InitializationAttempt attempt = exampleAttempt();
  const Eigen::Vector3d g_G(0.0, std::sin(0.01), -std::cos(0.01));
  const AttemptRecord record = makeAttemptRecord(attempt, 9.81, truthOf(attempt), g_G);
  ASSERT_EQ(record.stages.size(), 2u);
  for (const StageRecord& stage : record.stages) {
    ASSERT_TRUE(stage.errors.has_value());
    EXPECT_EQ(stage.errors->gravity_deg, 0.0);
    EXPECT_NEAR(stage.errors->gravity_corrected_deg, 0.01 * 180 / M_PI, 1e-12);
  }
}

}  // namespace
}  // namespace etalon
