#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/initialization/plugin_loader.h"
#include "etalon/odometry/window_initialization.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

constexpr Motion kMovingWithExcitation[] = {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                                            Motion::kPureRotation};

Initializer::Ptr load(const std::string& name, const std::string& ini) {
  PluginLoader loader({ETALON_INITIALIZERS});
  Initializer::Ptr initializer = loader.create(name);
  ParameterSet parameters(name);
  initializer->declareParameters(parameters);
  parameters.read(IniFile::fromText("[" + name + "]\n" + ini, "test"));
  return initializer;
}

class EveryInitializer : public ::testing::TestWithParam<const char*> {};

void expectNumericalPrecision(const WindowErrors& e) {
  // The bars for noise-free data.
  EXPECT_LT(e.rre_deg, 1e-4);
  EXPECT_LT(e.gravity_deg, 0.01);
  EXPECT_LT(e.gyro_bias_rps, 1e-5);
  EXPECT_LT(e.accel_bias_mps2, 1e-5);
  EXPECT_LT(e.velocity_mps, 1e-4);
  EXPECT_LT(e.ate_m, 1e-5);
}

std::vector<KeyframeState> states(const InitializationAttempt& attempt) {
  std::vector<KeyframeState> result;
  for (size_t k = 0; k < attempt.vi_ba.states.size(); ++k)
    result.push_back(
        {attempt.keyframes[k], attempt.vi_ba.states[k].T_WB, attempt.vi_ba.states[k].v_WB});
  return result;
}

TEST_P(EveryInitializer, IsExactOnNoiseFreeDataBeforeAndAfterViBa) {
  // True biases with the priors switched off: with them on, they would (rightly) pull the
  // estimates.
  const Initializer::Ptr initializer =
      load(GetParam(), "prior_gyro_information = 0\nprior_accel_information = 0\n");
  for (const Motion motion : kMovingWithExcitation) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    options.priors.sigma_gyro_rps = options.priors.sigma_accel_mps2 = 1e5;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    WindowOptions run;
    run.priors = options.priors;
    run.vi_ba.rounds = 4;
    run.vi_ba.iterations_per_round = 30;
    run.vi_ba.reintegrate_gyro_rps = run.vi_ba.reintegrate_accel_mps2 = 0.0;
    const InitializationAttempt attempt =
        attemptInitialization(makeProblem(window, options), *initializer, run);
    ASSERT_TRUE(attempt.init.ok()) << attempt.init.reason;
    expectNumericalPrecision(errorsOf(attempt.init.states, attempt.init.bias, window));
    ASSERT_TRUE(attempt.has_vi_ba);
    expectNumericalPrecision(errorsOf(states(attempt), attempt.vi_ba.bias, window));
    EXPECT_TRUE(attempt.decision.accepted) << attempt.decision.reason;
  }
}

TEST_P(EveryInitializer, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  const Initializer::Ptr initializer = load(GetParam(), "");
  for (const Motion motion : testing::kAllMotions) {  // at rest and at constant velocity, too
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationAttempt attempt =
        attemptInitialization(makeProblem(window, options), *initializer, WindowOptions());
    ASSERT_TRUE(attempt.init.ok()) << attempt.init.reason;
    expectNumericalPrecision(errorsOf(attempt.init.states, attempt.init.bias, window));
    expectNumericalPrecision(errorsOf(states(attempt), attempt.vi_ba.bias, window));
    EXPECT_TRUE(attempt.decision.accepted) << attempt.decision.reason;
  }
}

TEST_P(EveryInitializer, IsAccurateOnNoisyDataWithOutliers) {
  const Initializer::Ptr initializer = load(GetParam(), "");
  for (const Motion motion : kMovingWithExcitation) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.sigma_px = options.assumed_sigma_px = 0.5;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    options.outlier_share = 0.1;
    options.bias = {{0.02, -0.06, 0.04}, {0.05, -0.04, 0.03}};
    WindowOptions run;
    run.odometry.sigma_px = 0.5;
    const SyntheticWindow window = testing::makeSyntheticWindow(options);
    const InitializationAttempt attempt =
        attemptInitialization(makeProblem(window, options), *initializer, run);
    ASSERT_TRUE(attempt.decision.accepted) << attempt.decision.reason;
    const WindowErrors e = errorsOf(states(attempt), attempt.vi_ba.bias, window);
    // Three to five times the Cramer-Rao bounds of a 2.25 s window at 1 px: one draw, not a mean.
    EXPECT_LT(e.rre_deg, 0.04);
    EXPECT_LT(e.velocity_mps, 0.02);
    EXPECT_LT(e.gyro_bias_rps, 3e-3);
    EXPECT_LT(e.gravity_deg, 1.5);
  }
}

TEST_P(EveryInitializer, GivesTheSameResultBitForBit) {
  const Initializer::Ptr initializer = load(GetParam(), "");
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationAttempt a =
      attemptInitialization(makeProblem(window, options), *initializer, WindowOptions());
  const InitializationAttempt b =
      attemptInitialization(makeProblem(window, options), *initializer, WindowOptions());
  ASSERT_TRUE(a.init.ok());
  for (size_t k = 0; k < a.init.states.size(); ++k) {
    EXPECT_EQ(a.init.states[k].T_WB.R, b.init.states[k].T_WB.R);
    EXPECT_EQ(a.init.states[k].T_WB.t, b.init.states[k].T_WB.t);
    EXPECT_EQ(a.init.states[k].v_WB, b.init.states[k].v_WB);
    EXPECT_EQ(a.vi_ba.states[k].T_WB.t, b.vi_ba.states[k].T_WB.t);
  }
  EXPECT_EQ(a.vi_ba.bias.accel, b.vi_ba.bias.accel);
}

TEST_P(EveryInitializer, RefusesTooFewTracksInWords) {
  const Initializer::Ptr initializer = load(GetParam(), "");
  SyntheticWindowOptions options;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames) frame.observations.resize(5);
  const InitializationAttempt attempt =
      attemptInitialization(makeProblem(window, options), *initializer, WindowOptions());
  EXPECT_FALSE(attempt.init.ok());
  EXPECT_FALSE(attempt.decision.accepted);
  EXPECT_FALSE(attempt.decision.reason.empty());
}

TEST_P(EveryInitializer, RefusesAnImuGapAndNonFiniteMeasurements) {
  const Initializer::Ptr initializer = load(GetParam(), "");
  const SyntheticWindowOptions options;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);

  SyntheticWindow with_gap = window;
  std::vector<ImuSample> samples;
  for (const ImuSample& s : window.imu.samples())
    if (std::abs(secondsBetween(options.start, s.t) - 1.0) > 0.1) samples.push_back(s);
  with_gap.imu = ImuBuffer(samples);
  const InitializationResult gap = initializer->initialize(makeProblem(with_gap, options));
  EXPECT_EQ(gap.status, InitializationStatus::kImuGap) << gap.reason;
  EXPECT_NEAR(gap.reason_value, 0.2, 0.02);

  SyntheticWindow with_nan = window;
  with_nan.frames[3].observations[2].left.x() = std::nan("");
  const InitializationResult nan = initializer->initialize(makeProblem(with_nan, options));
  EXPECT_EQ(nan.status, InitializationStatus::kInvalidInput) << nan.reason;
}

INSTANTIATE_TEST_SUITE_P(Plugins, EveryInitializer,
                         ::testing::Values("eta", "orbslam3_inertial_only"),
                         [](const auto& plugin) { return std::string(plugin.param); });

TEST(Eta, FreeLandmarksAreExactToo) {
  const Initializer::Ptr initializer =
      load("eta", "landmarks = free\nprior_gyro_information = 0\nprior_accel_information = 0\n");
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult result = initializer->initialize(makeProblem(window, options));
  ASSERT_TRUE(result.ok()) << result.reason;
  expectNumericalPrecision(errorsOf(result.states, result.bias, window));
}

TEST(OrbSlam3InertialOnly, PinsTheAccelerometerBiasAsPublished) {
  const Initializer::Ptr initializer = load("orbslam3_inertial_only", "");
  SyntheticWindowOptions options;
  options.bias.accel = {0.15, 0.0, 0.0};
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationResult result = initializer->initialize(makeProblem(window, options));
  ASSERT_TRUE(result.ok()) << result.reason;
  const WindowErrors e = errorsOf(result.states, result.bias, window);
  // A prior of 3.2e-3 m/s^2 against a true bias of 0.15: gravity pays with up to 0.15/9.81 rad.
  EXPECT_GT(e.gravity_deg, 0.1);
  EXPECT_LT(e.gravity_deg, 1.0);
}

}  // namespace
}  // namespace etalon
