#include <gtest/gtest.h>

#include "etalon/pipeline/window_initialization.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::Motion;
using testing::moving;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

const std::string kWithoutPriors = "prior_gyro_information = 0\nprior_accel_information = 0\n";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(Eta, IsExactOnNoiseFreeDataBeforeAndAfterViBa) {
  testing::expectExactBeforeAndAfterViBa(*load(kWithoutPriors));
}

TEST(Eta, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(Eta, FreeLandmarksAreExactToo) {
  SyntheticWindowOptions options = moving();
  options.bias = testing::kBiases;
  testing::expectWithin(runOn(options, *load("landmarks = free\n" + kWithoutPriors)),
                        testing::kNumericalPrecision);
}

TEST(Eta, FollowsAGyroBiasOfEitherSign) {
  for (const double sign : {-1.0, 1.0}) {
    SyntheticWindowOptions options = moving();
    options.bias.gyro = sign * testing::kBiases.gyro;
    const Outcome o = runOn(options, *load());
    ASSERT_TRUE(o.result) << o.result.error().reason;
    // The MAP's prior of 0.1 rad/s pulls by a part in 1e3 at most.
    EXPECT_LT(o.errors.gyro_bias_rps, 1e-4);
  }
}

TEST(Eta, IsAccurateOnNoisyDataWithOutliers) { testing::expectAccurateAfterViBa(*load()); }

TEST(Eta, RotationsAreTheGyrosWithItsBiasRemoved) {
  // A bias error of 0.001 rad/s turns the body by 0.014 deg in 0.25 s, whatever the images say.
  SyntheticWindowOptions options = moving();
  options.priors.mean.gyro = {0.001, 0.0, 0.0};
  const Outcome o = runOn(options, *load("prior_gyro_information = 1e18"));
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_NEAR(o.errors.gyro_bias_rps, 0.001, 1e-6);
  EXPECT_NEAR(o.errors.rre_deg, 180.0 / M_PI * 0.001 * 0.25, 5e-4);
}

TEST(Eta, GravityInheritsThePinnedAccelerometerBiasUntilViBaFreesIt) {
  SyntheticWindowOptions options = moving();
  options.bias.accel = {0.15, 0.0, 0.0};
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationAttempt attempt =
      attemptInitialization(makeProblem(window, options), *load(), WindowOptions());
  ASSERT_TRUE(attempt.accepted()) << attempt.decision.error().reason;
  const double before = errorsOf(attempt.init->states, attempt.init->bias, window).gravity_deg;
  EXPECT_GT(before, 0.1);
  EXPECT_LT(before, 1.0);  // |b_a| / g is 0.88 deg
  std::vector<StampedState> states;
  for (size_t k = 0; k < attempt.vi_ba.states.size(); ++k)
    states.emplace_back(attempt.keyframes[k], attempt.vi_ba.states[k]);
  EXPECT_LT(errorsOf(states, attempt.vi_ba.bias, window).gravity_deg, 0.3 * before);
}

TEST(Eta, ErrsAsItsCovarianceSays) { testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30); }

TEST(Eta, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); });
}

TEST(Eta, RefusesTooFewTracksInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusal(runOn(moving(), *load("min_landmarks = 100000")).result,
                         RefusalStatus::kTooFewTracks, "landmarks in the window");
}

TEST(Eta, RefusesAKeyframeWithTooFewInliers) {
  const InitializationResult result = runOn(moving(), *load("min_inliers = 100000")).result;
  testing::expectRefusal(result, RefusalStatus::kTooFewTracks,
                         "agree with the translation of the weakest keyframe");
  EXPECT_GT(*result.error().value, 100.0);  // without noise all that the weakest keyframe sees
}

TEST(Eta, RefusesAMapThatIsNotConvergedOrIllConditioned) {
  testing::expectRefusal(runOn(moving(), *load("max_iterations = 1")).result,
                         RefusalStatus::kNotConverged, "did not converge");
  testing::expectRefusal(runOn(moving(), *load("max_sigma_gravity_deg = 0")).result,
                         RefusalStatus::kIllConditioned, "gravity direction");
}

TEST(Eta, RefusesAnImuGapAndNonFiniteMeasurements) { testing::expectRefusesBrokenInput(*load()); }

}  // namespace
}  // namespace etalon
