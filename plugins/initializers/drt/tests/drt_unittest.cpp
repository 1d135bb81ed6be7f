#include <gtest/gtest.h>

#include <string>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::Motion;
using testing::moving;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

class DrtVariants : public ::testing::TestWithParam<const char*> {
 protected:
  static Initializer::Ptr loadIt(const std::string& more = "") {
    return load(std::string("variant = ") + GetParam() + "\n" + more);
  }
  static bool estimatesAccelBias() { return std::string(GetParam()) == "tight"; }
};

TEST_P(DrtVariants, IsExactOnNoiseFreeDataAndFollowsAKnownBias) {
  WindowErrors bounds = testing::kNumericalPrecision;
  bounds.accel_bias_mps2 = 1e-4;
  for (const char* weighting : {"robust", "none"})
    for (const double sign : {-1.0, 1.0})
      for (const Motion motion : testing::kExcitingMotions) {
        SCOPED_TRACE(std::string(weighting) + " " + testing::toString(motion));
        ImuBias bias{sign * testing::kBiases.gyro, sign * testing::kBiases.accel};
        if (!estimatesAccelBias()) bias.accel.setZero();
        testing::expectWithin(runOn(testing::freeOptions(motion, bias),
                                    *loadIt(std::string("weighting = ") + weighting)),
                              bounds);
      }
}

TEST_P(DrtVariants, IsExactAtRestAndAtConstantVelocityToo) {
  testing::expectExactAtRestAndAtConstantVelocity(*loadIt());
}

TEST_P(DrtVariants, IsExactWhereTheAccelerometerBiasIsKnownAndFixed) {
  SyntheticWindowOptions options = moving();
  options.bias = testing::kBiases;
  options.priors.mean.accel = testing::kBiases.accel;
  testing::expectWithin(runOn(options, *loadIt("accel_bias = mean")), testing::kNumericalPrecision);
}

TEST_P(DrtVariants, AFixedAccelerometerBiasGoesIntoGravity) {
  SyntheticWindowOptions options = moving();
  options.bias.accel = {0.15, 0.0, 0.0};
  const Outcome o = runOn(options, *loadIt("accel_bias = mean"));
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_LT(o.result->bias.accel.norm(), 1e-9);
  EXPECT_GT(o.errors.gravity_deg, 0.1);
  EXPECT_LT(o.errors.gravity_deg, 1.0);  // |b_a| / g is 0.88 deg
}

TEST_P(DrtVariants, SurvivesNoiseAndThirtyPercentOutliers) {
  for (const Motion motion : {Motion::kAggressive, Motion::kCircle})
    testing::expectSurvivesThirtyPercentOutliers(*loadIt(), motion);
}

TEST_P(DrtVariants, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return loadIt(); });
}

TEST_P(DrtVariants, RefusesTooFewTracksAndNoOverlapInWords) {
  const InitializationResult too_few = testing::expectRefusesTooFewTracks(*loadIt());
  EXPECT_EQ(too_few.error().status, RefusalStatus::kTooFewTracks);
  testing::expectRefusesTracksWithoutOverlap(*loadIt());
}

TEST_P(DrtVariants, RefusesTracksThatAreNoisierThanBelieved) {
  testing::expectRefusesTracksNoisierThanBelieved(*loadIt());
}

INSTANTIATE_TEST_SUITE_P(Variant, DrtVariants, ::testing::Values("tight", "loose"),
                         [](const auto& variant) { return std::string(variant.param); });

TEST(Drt, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(Drt, ErrsInProportionToThePixelNoise) {
  // The linear solution alone has errors of 0.0091 and 0.0269 m/s.
  testing::expectErrsInProportionToThePixelNoise(*load());
}

TEST(Drt, ErrsAsItsCovarianceSays) {
  // The gyro bias comes from the same pixels as the translations, but counts as independent.
  testing::expectErrsAsItsCovarianceSays(*load(), 0.1);
}

TEST(Drt, ErrsAsItsCovarianceSaysInEveryForm) {
  for (const char* ini : {"refine = no", "accel_bias = mean", "variant = loose",
                          "refine = no\naccel_bias = mean", "refine = no\nvariant = loose"}) {
    SCOPED_TRACE(ini);
    testing::expectErrsAsItsCovarianceSays(*load(ini), 0.2, 35);
  }
}

TEST(Drt, NeedsNoVisualSolution) {
  const Initializer::Ptr initializer = load();
  EXPECT_FALSE(initializer->needsVisualSolution());
  const SyntheticWindowOptions options;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const InitializationProblem problem = makeProblem(window, options);
  EXPECT_TRUE(initializer->initialize(problem));
  EXPECT_FALSE(problem.visualSolutionComputed());
}

TEST(Drt, RefusesForTheReasonsOfTheGyroBias) {
  testing::expectRefusal(runOn(moving(), *load("nec_min_matches = 100000")).result,
                         RefusalStatus::kTooFewTracks, "neighbouring keyframes share");
  testing::expectRefusal(runOn(moving(), *load("max_sigma_gyro_rps = 1e-12")).result,
                         RefusalStatus::kIllConditioned, "too little parallax");
  SyntheticWindowOptions biased = moving();
  biased.bias.gyro = testing::kBiases.gyro;
  testing::expectRefusal(runOn(biased, *load("max_gyro_bias_rps = 0.05")).result,
                         RefusalStatus::kImplausible, "from its prior mean");
}

TEST(Drt, RefusesTooLittleSupportOfTheTranslations) {
  const InitializationResult support = runOn(moving(), *load("min_landmarks = 100000")).result;
  testing::expectRefusal(support, RefusalStatus::kTooFewTracks, "landmarks with parallax");
  EXPECT_GT(*support.error().value, 100.0);
  // No two rays are a radian apart, so no landmark has a base.
  const InitializationResult parallax = runOn(moving(), *load("min_parallax_rad = 1")).result;
  testing::expectRefusal(parallax, RefusalStatus::kTooFewTracks, "landmarks with parallax");
  EXPECT_EQ(*parallax.error().value, 0.0);
}

TEST(Drt, RefusesResidualsAboveWhatSigmaPromises) {
  const InitializationResult result =
      runOn(testing::noisyOptions(Motion::kAggressive, 0.0, ImuBias()), *load("max_noise = 0.1"))
          .result;
  testing::expectRefusal(result, RefusalStatus::kNotConverged, "translation residuals");
  EXPECT_NEAR(*result.error().value, 1.0, 0.3);  // the true noise is sigma_px
}

TEST(Drt, RefusesAnAccelerometerThatShowsNoGravity) {
  testing::expectRefusesAnAccelerometerThatShowsNoGravity(*load());
}

TEST(Drt, RefusesAnImuGapAndNonFiniteMeasurements) { testing::expectRefusesBrokenInput(*load()); }

}  // namespace
}  // namespace etalon
