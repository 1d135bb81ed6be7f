// vins_alignment and joint_closed_form, loaded by name, on windows with exact truth.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/initialization/plugin_loader.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

constexpr Motion kMoving[] = {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                              Motion::kPureRotation};
const Vector3d kGyroBias(0.02, -0.06, 0.04);
const Vector3d kAccelBias(0.1, -0.08, 0.12);

Initializer::Ptr load(const std::string& name, const std::string& ini) {
  PluginLoader loader({ETALON_INITIALIZERS});
  Initializer::Ptr initializer = loader.create(name);
  ParameterSet parameters(name);
  initializer->declareParameters(parameters);
  parameters.read(IniFile::fromText("[" + name + "]\n" + ini, "test"));
  return initializer;
}

struct Outcome {
  SyntheticWindow window;
  InitializationResult result;
  WindowErrors errors;
};

Outcome run(const std::string& name, const std::string& ini,
            const SyntheticWindowOptions& options) {
  Outcome outcome;
  outcome.window = testing::makeSyntheticWindow(options);
  outcome.result = load(name, ini)->initialize(makeProblem(outcome.window, options));
  if (outcome.result.ok())
    outcome.errors = errorsOf(outcome.result.states, outcome.result.bias, outcome.window);
  return outcome;
}

void expectNumericalPrecision(const Outcome& o) {
  ASSERT_TRUE(o.result.ok()) << o.result.reason;
  EXPECT_LT(o.errors.rre_deg, 1e-4);
  EXPECT_LT(o.errors.gravity_deg, 0.01);
  EXPECT_LT(o.errors.gyro_bias_rps, 1e-5);
  EXPECT_LT(o.errors.accel_bias_mps2, 1e-5);
  EXPECT_LT(o.errors.velocity_mps, 1e-4);
  EXPECT_LT(o.errors.ate_m, 1e-5);
}

SyntheticWindowOptions noisy(Motion motion, double outlier_share) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.sigma_px = options.assumed_sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.outlier_share = outlier_share;
  options.bias = {kGyroBias, {0.05, -0.04, 0.03}};
  return options;
}

// --- vins_alignment -----------------------------------------------------------------------------

TEST(VinsAlignment, IsExactWithoutNoiseWithEveryWeightWhereTheAccelerometerBiasIsKnown) {
  for (const char* weights : {"none", "imu", "imu_and_vision"})
    for (const Motion motion : kMoving) {
      SCOPED_TRACE(std::string(weights) + " " + testing::toString(motion));
      SyntheticWindowOptions options;
      options.motion = motion;
      options.bias = {kGyroBias, kAccelBias};
      options.priors.mean.accel = kAccelBias;
      expectNumericalPrecision(
          run("vins_alignment", "gyro_passes = 5\nweights = " + std::string(weights), options));
    }
}

TEST(VinsAlignment, LeavesTheAccelerometerBiasToGravity) {
  SyntheticWindowOptions options;
  options.bias = {kGyroBias, kAccelBias};  // the prior's mean is zero
  const Outcome o = run("vins_alignment", "", options);
  ASSERT_TRUE(o.result.ok()) << o.result.reason;
  EXPECT_EQ(o.result.bias.accel, Vector3d::Zero());
  EXPECT_LT(o.errors.gyro_bias_rps, 1e-5);  // rotations do not know b_a
  EXPECT_GT(o.errors.gravity_deg, 0.1);     // at most |b_a| / g = 1.02 deg
  EXPECT_LT(o.errors.gravity_deg, 1.1);
}

TEST(VinsAlignment, OneGyroPassIsOffToSecondOrder) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.bias.gyro = {0.1, -0.1, 0.1};
  const Outcome once = run("vins_alignment", "gyro_passes = 1", options);
  ASSERT_TRUE(once.result.ok()) << once.result.reason;
  EXPECT_GT(once.errors.gyro_bias_rps, 1e-5);
  EXPECT_LT(once.errors.gyro_bias_rps, 0.02 * options.bias.gyro.norm());
}

TEST(VinsAlignment, FusionTakesTheFirstSpecificForceForGravity) {
  SyntheticWindowOptions options;
  options.bias.gyro = kGyroBias;
  options.motion = Motion::kStandstill;
  expectNumericalPrecision(run("vins_alignment", "variant = fusion", options));
  options.motion = Motion::kConstantVelocity;  // gravity right, velocities wrong by the first one
  const Outcome steady = run("vins_alignment", "variant = fusion", options);
  ASSERT_TRUE(steady.result.ok()) << steady.result.reason;
  EXPECT_LT(steady.errors.gravity_deg, 0.01);
  EXPECT_NEAR(steady.errors.velocity_mps, Vector3d(0.8, 0.3, 0.1).norm(), 1e-3);
  options.motion = Motion::kCircle;  // 1 m/s^2 to the side
  const Outcome circle = run("vins_alignment", "variant = fusion", options);
  ASSERT_TRUE(circle.result.ok()) << circle.result.reason;
  EXPECT_NEAR(circle.errors.gravity_deg, 180.0 / M_PI * std::atan(1.0 / 9.81), 0.1);
  EXPECT_LT(circle.errors.gyro_bias_rps, 1e-5);
}

TEST(VinsAlignment, SurvivesThirtyPercentOfOutliers) {
  const Outcome o = run("vins_alignment", "", noisy(Motion::kGentle, 0.3));
  ASSERT_TRUE(o.result.ok()) << o.result.reason;
  // The outliers meet stereo odometry, whose poses this method takes as they are: ten times what is
  // left without them.
  EXPECT_LT(o.errors.rre_deg, 0.3);
  EXPECT_LT(o.errors.velocity_mps, 0.15);
  EXPECT_LT(o.errors.gyro_bias_rps, 0.01);
}

TEST(VinsAlignment, RefusesAGravityOfTheWrongMagnitude) {
  SyntheticWindowOptions options;
  options.gravity_mps2 = 9.81;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& s : samples) s.accel *= 1.3;
  window.imu = ImuBuffer(samples);
  const InitializationResult result =
      load("vins_alignment", "")->initialize(makeProblem(window, options));
  EXPECT_EQ(result.status, InitializationStatus::kImplausible) << result.reason;
  EXPECT_NEAR(result.reason_value, 0.3 * 9.81, 0.5);
}

// --- joint_closed_form --------------------------------------------------------------------------

/**
 * Priors that hardly say anything, so that they do not pull on noise-free data. Without any,
 * gravity and its mirror image with a b_a of 2 g explain a rotation about the vertical equally
 * well.
 */
SyntheticWindowOptions free(Motion motion) {
  SyntheticWindowOptions options;
  options.motion = motion;
  options.bias = {kGyroBias, kAccelBias};
  options.priors.sigma_gyro_rps = 1e5;
  options.priors.sigma_accel_mps2 = 30.0;
  return options;
}

TEST(JointClosedForm, IsExactWithoutNoise) {
  for (const char* ini : {"", "imu_noise = no", "frame_stride = 2"})
    for (const Motion motion : kMoving) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      expectNumericalPrecision(run("joint_closed_form",
                                   std::string(ini) + "\npasses = 30\nconverged_rps = 1e-9",
                                   free(motion)));
    }
}

TEST(JointClosedForm, IsExactInTheFormPublishedWhereTheAccelerometerBiasIsKnown) {
  for (const Motion motion : testing::kAllMotions) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options = free(motion);
    options.priors.mean.accel = kAccelBias;
    expectNumericalPrecision(
        run("joint_closed_form",
            "imu_noise = no\naccel_bias = prior\npasses = 30\nconverged_rps = 1e-9", options));
  }
}

TEST(JointClosedForm, FindsBiasesOfEitherSign) {
  for (const double sign : {-1.0, 1.0}) {
    SyntheticWindowOptions options;
    options.motion = Motion::kAggressive;
    options.bias = {sign * kGyroBias, sign * kAccelBias};
    const Outcome o = run("joint_closed_form", "", options);
    ASSERT_TRUE(o.result.ok()) << o.result.reason;
    // The prior of 0.1 m/s^2 pulls b_a, and gravity with it.
    EXPECT_LT((o.result.bias.gyro - options.bias.gyro).norm(), 5e-4);
    EXPECT_LT((o.result.bias.accel - options.bias.accel).norm(), 0.05);
  }
}

TEST(JointClosedForm, NeedsNoVisualOdometry) {
  const SyntheticWindowOptions options;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const Initializer::Ptr initializer = load("joint_closed_form", "");
  EXPECT_FALSE(initializer->needsVisualSolution());
  const InitializationProblem problem = makeProblem(window, options);
  EXPECT_TRUE(initializer->initialize(problem).ok());
  EXPECT_FALSE(problem.visualSolutionComputed());
}

TEST(JointClosedForm, IsAccurateOnNoisyDataWithOutliers) {
  for (const double share : {0.0, 0.1, 0.3})
    for (const Motion motion : kMoving) {
      SCOPED_TRACE(std::to_string(share) + " " + testing::toString(motion));
      const Outcome o = run("joint_closed_form", "", noisy(motion, share));
      ASSERT_TRUE(o.result.ok()) << o.result.reason;
      // Three to five times the Cramer-Rao bounds of such a window: one draw, not a mean. With 30 %
      // of outlying pixels half of the stereo pairs are broken.
      EXPECT_LT(o.errors.rre_deg, share < 0.2 ? 0.04 : 0.08);
      EXPECT_LT(o.errors.velocity_mps, share < 0.2 ? 0.02 : 0.04);
      EXPECT_LT(o.errors.gyro_bias_rps, 3e-3);
      EXPECT_LT(o.errors.gravity_deg, 1.5);
    }
}

TEST(JointClosedForm, RefusesAWindowWithoutRightImages) {
  const SyntheticWindowOptions options;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.has_right = false;
  const InitializationResult result =
      load("joint_closed_form", "")->initialize(makeProblem(window, options));
  EXPECT_EQ(result.status, InitializationStatus::kTooFewTracks) << result.reason;
  EXPECT_EQ(result.reason_value, 0.0);
}

TEST(JointClosedForm, RefusesTracksThatDisagreeWithTheImu) {
  SyntheticWindowOptions options = noisy(Motion::kAggressive, 0.9);
  const Outcome o = run("joint_closed_form", "", options);
  EXPECT_FALSE(o.result.ok());
  EXPECT_FALSE(o.result.reason.empty());
}

TEST(LinearFamily, RefusesTooFewTracksInWords) {
  for (const char* name : {"vins_alignment", "joint_closed_form"}) {
    SyntheticWindowOptions options;
    SyntheticWindow window = testing::makeSyntheticWindow(options);
    for (TrackedFrame& frame : window.frames) frame.observations.resize(5);
    const InitializationResult result = load(name, "")->initialize(makeProblem(window, options));
    EXPECT_FALSE(result.ok());
    EXPECT_FALSE(result.reason.empty());
  }
}

TEST(LinearFamily, GivesTheSameResultBitForBit) {
  for (const char* name : {"vins_alignment", "joint_closed_form"}) {
    const Outcome a = run(name, "", noisy(Motion::kAggressive, 0.1));
    const Outcome b = run(name, "", noisy(Motion::kAggressive, 0.1));
    ASSERT_TRUE(a.result.ok()) << a.result.reason;
    for (size_t k = 0; k < a.result.states.size(); ++k) {
      EXPECT_EQ(a.result.states[k].T_WB.R, b.result.states[k].T_WB.R);
      EXPECT_EQ(a.result.states[k].T_WB.t, b.result.states[k].T_WB.t);
      EXPECT_EQ(a.result.states[k].v_WB, b.result.states[k].v_WB);
    }
    EXPECT_EQ(a.result.bias.gyro, b.result.bias.gyro);
  }
}

}  // namespace
}  // namespace etalon
