#include "etalon/evaluation/consistency.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/benchmark/summary.h"
#include "etalon/core/so3.h"
#include "etalon/evaluation/window_metrics.h"
#include "etalon/runlog/attempt_record.h"

namespace etalon {
namespace {

const Eigen::Vector3d kTilt(0.003, -0.004, 0.0);       // rad, about x and y of W
const Eigen::Vector3d kVelocityError(0.1, 0.2, -0.2);  // m/s
const Eigen::Matrix3d kYaw = expSO3({0.0, 0.0, 2.5});

/** Three keyframes of a turning body. The estimate's world is turned by kYaw and tilted by kTilt;
 * the last velocity is off by kVelocityError, the first ones by much more, b_g by 2e-3 rad/s. */
struct Example {
  GroundTruth truth;
  InitializationAttempt attempt;

  Example() {
    truth.has_velocity = truth.has_biases = true;
    attempt.init = Initialization();
    for (int k = 0; k < 3; ++k) {
      StampedState state;
      state.t = 1'000'000'000LL + 250'000'000LL * k;
      state.T_WB.R = expSO3({0.4, -0.3 * k, 0.2 * k});
      state.v_WB = Eigen::Vector3d(1.0, 0.5 * k, -0.2);
      state.bias.gyro = Eigen::Vector3d(0.01, 0.0, 0.001 * k);  // 0.001 on average
      truth.states.push_back(state);
      const Eigen::Vector3d dv = k == 2 ? kVelocityError : Eigen::Vector3d(5.0, 5.0, 5.0);
      attempt.keyframes.push_back(state.t);
      attempt.vi_ba.states.push_back(
          {{expSO3(kTilt) * kYaw * state.T_WB.R, state.T_WB.t}, kYaw * state.v_WB + dv, {}});
      attempt.init->states.emplace_back(state.t, attempt.vi_ba.states.back());
    }
    attempt.init->bias.gyro = attempt.vi_ba.bias.gyro = {0.012, 0.0, 0.001};
    attempt.has_vi_ba = true;
    // Sigmas: tilt 0.005 and 0.002 rad, velocity 0.1 and 0.4 m/s, b_g 1e-3 rad/s.
    Eigen::VectorXd sigma = Eigen::VectorXd::Ones(33);
    sigma.segment<3>(27).setConstant(1e-3);
    sigma.segment<3>(24) << 0.1, 0.4, 0.4;
    const Eigen::Matrix3d R = attempt.vi_ba.states.front().T_WB.R;
    const Eigen::Vector3d tilt(0.005, 0.002, 0.0);
    attempt.vi_ba.covariance = sigma.cwiseAbs2().asDiagonal();
    attempt.vi_ba.covariance.topLeftCorner<3, 3>() =
        R.transpose() * Eigen::Matrix3d(tilt.cwiseAbs2().asDiagonal()) * R;
    Eigen::VectorXd diagonal = Eigen::VectorXd::Ones(11);
    diagonal.segment<2>(6) << 0.006, 0.008;
    attempt.init->covariance = diagonal.cwiseAbs2().asDiagonal();
  }
};

TEST(Consistency, NeesAreErrorsOverTheClaimedCovariance) {
  const Example example;
  const AttemptRecord record = makeAttemptRecord(example.attempt, 9.81, example.truth);
  const WindowErrors vi_ba = *record.stage(kStageViBa)->errors;
  // Rounding of the rotations is 1e-16 of 0.003 rad.
  EXPECT_NEAR(vi_ba.tilt_nees, (0.6 * 0.6 + 2.0 * 2.0) / 2.0, 1e-9);
  EXPECT_NEAR(vi_ba.velocity_nees, (1.0 + 0.25 + 0.25) / 3.0, 1e-12);
  EXPECT_NEAR(vi_ba.gyro_bias_nees, 4.0 / 3.0, 1e-9);
  EXPECT_NEAR(vi_ba.accel_bias_nees, 0.0, 1e-12);
  const WindowErrors init = *record.stage(kStageInit)->errors;
  EXPECT_NEAR(init.tilt_nees, (0.25 + 0.25) / 2.0, 1e-9);
  EXPECT_NEAR(init.velocity_nees, 0.09 / 3.0, 1e-12);
}

TEST(Consistency, WithoutClaimOrTruthThereIsNone) {
  Example example;
  example.attempt.init->covariance.resize(0, 0);
  example.attempt.vi_ba.covariance(29, 29) = 0.0;  // b_g is said to be known without error
  example.truth.has_velocity = false;
  const AttemptRecord record = makeAttemptRecord(example.attempt, 9.81, example.truth);
  for (const WindowMetric& metric : neesMetrics())
    EXPECT_TRUE(std::isnan(record.stage(kStageInit)->errors.value().*metric.error)) << metric.key;
  const WindowErrors vi_ba = *record.stage(kStageViBa)->errors;
  EXPECT_TRUE(std::isnan(vi_ba.gyro_bias_nees));
  EXPECT_TRUE(std::isnan(vi_ba.velocity_nees));
  EXPECT_FALSE(std::isnan(vi_ba.tilt_nees));
  example.truth.states.erase(example.truth.states.begin());  // none at the first keyframe
  EXPECT_TRUE(std::isnan(makeAttemptRecord(example.attempt, 9.81, example.truth)
                             .stage(kStageViBa)
                             ->errors->tilt_nees));
}

TEST(Consistency, WindowsAndSummaryHaveTheColumns) {
  const Example example;
  BenchmarkRecord record;
  WindowResult result;
  result.sequence = "V1";
  result.keyframes = 3;
  result.rate_hz = 4.0;
  result.initializer = "eta";
  result.attempt = makeAttemptRecord(example.attempt, 9.81, example.truth);
  record.results = {result, result, result};
  record.results[1].attempt.stages[1].errors->tilt_nees = 0.5;
  record.results[2].attempt.stages[1].errors->tilt_nees = WindowErrors::kNone;
  const std::string windows = windowsCsv(windowRows(record));
  EXPECT_NE(
      windows.find(",scale_error,tilt_nees,velocity_nees,gyro_bias_nees,accel_bias_nees,window_s,"
                   "runtime_ms\n"),
      std::string::npos);
  EXPECT_NE(windows.find(",2.18,0.5,1.33333333,"), std::string::npos) << windows;
  const SummaryRow vi_ba = summarize(record)[2];
  ASSERT_EQ(vi_ba.stage, kStageViBa);
  EXPECT_EQ(vi_ba.nees[0].count, 2);
  EXPECT_NEAR(vi_ba.nees[0].mean, 1.34, 1e-9);
  EXPECT_NEAR(vi_ba.nees[1].median, 0.5, 1e-9);
}

}  // namespace
}  // namespace etalon
