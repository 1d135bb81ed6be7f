#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::kBiases;
using testing::Motion;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(VinsAlignment, IsExactWithoutNoiseWithEveryWeightWhereTheAccelerometerBiasIsKnown) {
  for (const char* weights : {"none", "imu", "imu_and_vision"})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(weights) + " " + testing::toString(motion));
      SyntheticWindowOptions options;
      options.motion = motion;
      options.bias = kBiases;
      options.priors.mean.accel = kBiases.accel;
      testing::expectWithin(
          runOn(options, *load("gyro_passes = 5\nweights = " + std::string(weights))),
          testing::kNumericalPrecision);
    }
}

TEST(VinsAlignment, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(VinsAlignment, TheExactMinimumOnTheSphereIsTheOneOfTheTangentPlane) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.1, {kBiases.gyro, {0.05, -0.04, 0.03}});
  const Outcome exact = runOn(options, *load("gravity_iterations = 0"));
  const Outcome steps = runOn(options, *load("gravity_iterations = 4"));
  ASSERT_TRUE(exact.result) << exact.result.error().reason;
  ASSERT_TRUE(steps.result) << steps.result.error().reason;
  EXPECT_GT(exact.errors.gravity_deg, 1e-3);  // it is a problem with noise
  for (size_t k = 0; k < exact.result->states.size(); ++k)
    EXPECT_LT((exact.result->states[k].v_WB - steps.result->states[k].v_WB).norm(), 1e-6);
}

TEST(VinsAlignment, LeavesTheAccelerometerBiasToGravity) {
  SyntheticWindowOptions options;
  options.bias = kBiases;  // the prior's mean is zero
  const Outcome o = runOn(options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_EQ(o.result->bias.accel, Vector3d::Zero());
  EXPECT_LT(o.errors.gyro_bias_rps, 1e-5);  // rotations do not depend on b_a
  EXPECT_GT(o.errors.gravity_deg, 0.1);     // at most |b_a| / g = 1.02 deg
  EXPECT_LT(o.errors.gravity_deg, 1.1);
}

TEST(VinsAlignment, FindsAGyroBiasOfEitherSign) {
  for (const double sign : {-1.0, 1.0}) {
    SyntheticWindowOptions options;
    options.motion = Motion::kAggressive;
    options.bias.gyro = sign * kBiases.gyro;
    testing::expectWithin(runOn(options, *load()), testing::kNumericalPrecision);
  }
}

TEST(VinsAlignment, OneGyroPassIsOffToSecondOrder) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.bias.gyro = {0.1, -0.1, 0.1};
  const Outcome once = runOn(options, *load("gyro_passes = 1"));
  ASSERT_TRUE(once.result) << once.result.error().reason;
  EXPECT_GT(once.errors.gyro_bias_rps, 1e-5);
  EXPECT_LT(once.errors.gyro_bias_rps, 0.02 * options.bias.gyro.norm());
}

TEST(VinsAlignment, EsvioIsThePublishedFormWhateverElseIsSet) {
  const SyntheticWindowOptions options = testing::noisyOptions(Motion::kAggressive, 0.1, kBiases);
  const Outcome esvio = runOn(options, *load("variant = esvio"));
  const Outcome published = runOn(options, *load("weights = none\ngyro_passes = 1"));
  ASSERT_TRUE(esvio.result && published.result);
  for (size_t k = 0; k < esvio.result->states.size(); ++k)
    EXPECT_EQ(esvio.result->states[k].v_WB, published.result->states[k].v_WB);
  EXPECT_EQ(esvio.result->bias.gyro, published.result->bias.gyro);
}

TEST(VinsAlignment, FusionTakesTheFirstSpecificForceForGravity) {
  const Initializer::Ptr fusion = load("variant = fusion");
  SyntheticWindowOptions options;
  options.bias.gyro = kBiases.gyro;
  options.motion = Motion::kStandstill;
  testing::expectWithin(runOn(options, *fusion), testing::kNumericalPrecision);
  options.motion = Motion::kConstantVelocity;  // gravity right, velocities wrong by the first one
  const Outcome steady = runOn(options, *fusion);
  ASSERT_TRUE(steady.result) << steady.result.error().reason;
  EXPECT_LT(steady.errors.gravity_deg, 0.01);
  EXPECT_NEAR(steady.errors.velocity_mps, Vector3d(0.8, 0.3, 0.1).norm(), 1e-3);
  options.motion = Motion::kCircle;  // 1 m/s^2 to the side
  const Outcome circle = runOn(options, *fusion);
  ASSERT_TRUE(circle.result) << circle.result.error().reason;
  EXPECT_NEAR(circle.errors.gravity_deg, 180.0 / M_PI * std::atan(1.0 / 9.81), 0.1);
  EXPECT_LT(circle.errors.gyro_bias_rps, 1e-5);
  // The alignment of the same window tells how far off it is.
  ASSERT_EQ(circle.result->covariance.rows(), 11 + 6 * (options.keyframes - 1));
  EXPECT_GT(circle.result->covariance.diagonal().segment<2>(6).sum(), std::pow(0.09, 2));
}

TEST(VinsAlignment, LeavesThePosesOfStereoOdometryAsTheyAre) {
  const SyntheticWindowOptions options = testing::noisyOptions(Motion::kAggressive, 0.1, kBiases);
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  const InitializationResult result = load()->initialize(problem);
  ASSERT_TRUE(result) << result.error().reason;
  const std::vector<SE3>& T_VB = problem.visualSolution()->T_VB;
  const SE3 T_WV = result->states[0].T_WB * T_VB[0].inverse();
  for (size_t k = 0; k < T_VB.size(); ++k)
    EXPECT_LT((result->states[k].T_WB.matrix() - (T_WV * T_VB[k]).matrix()).norm(), 1e-12);
}

TEST(VinsAlignment, SurvivesThirtyPercentOfOutliers) {
  const Outcome o = runOn(
      testing::noisyOptions(Motion::kGentle, 0.3, {kBiases.gyro, {0.05, -0.04, 0.03}}), *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  // The outliers affect stereo odometry, whose poses this method takes as they are. The bounds are
  // ten times the errors without outliers.
  EXPECT_LT(o.errors.rre_deg, 0.3);
  EXPECT_LT(o.errors.velocity_mps, 0.15);
  EXPECT_LT(o.errors.gyro_bias_rps, 0.01);
}

TEST(VinsAlignment, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30);
}

TEST(VinsAlignment, GivesTheSameResultBitForBit) {
  testing::expectSameBits(
      [] { return load(); },
      testing::noisyOptions(Motion::kAggressive, 0.1, {kBiases.gyro, {0.05, -0.04, 0.03}}));
}

TEST(VinsAlignment, RefusesAGravityOfTheWrongMagnitude) {
  SyntheticWindowOptions options;
  options.gravity_mps2 = 9.81;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& s : samples) s.accel *= 1.3;
  window.imu = ImuBuffer(samples);
  const InitializationResult result = runOn(window, options, *load()).result;
  EXPECT_EQ(result.error().status, RefusalStatus::kImplausible);
  EXPECT_NEAR(*result.error().value, 0.3 * 9.81, 0.5);
}

TEST(VinsAlignment, RefusesTwoKeyframesWhichDetermineNothing) {
  SyntheticWindowOptions options;
  options.keyframes = 2;  // six equations for two velocities and gravity
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "do not determine velocities and gravity");
}

TEST(VinsAlignment, RefusesTooFewTracksInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusal(runOn(SyntheticWindowOptions(), *load("min_landmarks = 100000")).result,
                         RefusalStatus::kTooFewTracks, "landmarks in the window");
}

TEST(VinsAlignment, RefusesAnImuGapAndNonFiniteMeasurements) {
  testing::expectRefusesBrokenInput(*load());
}

TEST(VinsAlignment, RefusesTwoKeyframesWhateverTheyShow) {
  for (const char* ini : {"", "weights = none", "weights = imu_and_vision"})
    for (unsigned seed = 1; seed <= 10; ++seed) {
      SyntheticWindowOptions options = testing::noisyOptions(Motion::kAggressive, 0.0, kBiases);
      options.keyframes = 2;
      options.seed = seed;
      testing::expectRefusal(runOn(options, *load(ini)).result, RefusalStatus::kIllConditioned,
                             "2 keyframes do not determine velocities and gravity");
    }
}

}  // namespace
}  // namespace etalon
