#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::Motion;
using testing::moving;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindowOptions;
using testing::WindowErrors;

/** One of: the default, the published configuration, b_g held in the MAP. */
struct Configuration {
  const char* label;
  const char* ini;
};
void PrintTo(const Configuration& configuration, std::ostream* out) { *out << configuration.label; }
constexpr Configuration kConfigurations[] = {
    {"default", ""},
    {"published",
     "nec_pairs = consecutive\nnec_cameras = left\nnec_weighting = none\nnec_in_map = seed\n"
     "nec_seed = prior\n"},
    {"held", "nec_in_map = hold\n"},
};

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

class StereoNecConfigurations : public ::testing::TestWithParam<Configuration> {
 protected:
  static Initializer::Ptr loadIt(const std::string& more = "") {
    return load(GetParam().ini + more);
  }
};

TEST_P(StereoNecConfigurations, IsExactOnNoiseFreeDataAndFollowsAKnownBias) {
  const Initializer::Ptr initializer =
      loadIt("prior_gyro_information = 0\nprior_accel_information = 0\n");
  WindowErrors bounds = testing::kNumericalPrecision;
  bounds.accel_bias_mps2 = 1e-4;
  for (const double sign : {-1.0, 1.0})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(testing::toString(motion));
      const ImuBias bias{sign * testing::kBiases.gyro, sign * testing::kBiases.accel};
      testing::expectWithin(runOn(testing::freeOptions(motion, bias), *initializer), bounds);
    }
}

TEST_P(StereoNecConfigurations, IsExactAtRestAndAtConstantVelocityToo) {
  testing::expectExactAtRestAndAtConstantVelocity(*loadIt());
}

TEST_P(StereoNecConfigurations, SurvivesNoiseAndThirtyPercentOutliers) {
  // The circle is left out, because stereo odometry gives up there.
  testing::expectSurvivesThirtyPercentOutliers(*loadIt(), Motion::kAggressive);
}

TEST_P(StereoNecConfigurations, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return loadIt(); });
}

TEST_P(StereoNecConfigurations, RefusesTooFewTracksAndNoOverlapInWords) {
  testing::expectRefusesTooFewTracks(*loadIt());
  testing::expectRefusesTracksWithoutOverlap(*loadIt());
}

TEST_P(StereoNecConfigurations, RefusesTracksThatAreNoisierThanBelieved) {
  testing::expectRefusesTracksNoisierThanBelieved(*loadIt());
}

INSTANTIATE_TEST_SUITE_P(Ini, StereoNecConfigurations, ::testing::ValuesIn(kConfigurations),
                         [](const auto& c) { return std::string(c.param.label); });

TEST(StereoNec, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(StereoNec, TheMapTakesTheGyroBiasAsItIsTold) {
  // All pairs and neighbours alone give different biases. As a seed the bias leaves no trace in the
  // MAP; held, it is the result.
  const auto apart = [](const std::string& in_map) {
    const SyntheticWindowOptions options =
        testing::noisyOptions(Motion::kAggressive, 0.0, {testing::kBiases.gyro, Vector3d::Zero()});
    const std::string ini = "nec_in_map = " + in_map + "\nreintegrations = 10\nnec_pairs = ";
    const Outcome all = runOn(options, *load(ini + "all"));
    const Outcome neighbours = runOn(options, *load(ini + "consecutive"));
    EXPECT_TRUE(all.result) << all.result.error().reason;
    EXPECT_TRUE(neighbours.result) << neighbours.result.error().reason;
    return (all.result->bias.gyro - neighbours.result->bias.gyro).norm();
  };
  EXPECT_LT(apart("seed"), 1e-6);
  EXPECT_GT(apart("hold"), 1e-5);
}

TEST(StereoNec, GravityInheritsThePinnedAccelerometerBias) {
  SyntheticWindowOptions options;
  options.bias.accel = {0.15, 0.0, 0.0};
  const Outcome o = runOn(options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_GT(o.errors.gravity_deg, 0.1);
  EXPECT_LT(o.errors.gravity_deg, 1.0);  // |b_a| / g is 0.88 deg
}

TEST(StereoNec, RefusesForEveryReasonOfTheGyroBias) {
  testing::expectRefusal(runOn(moving(), *load("nec_min_matches = 100000")).result,
                         RefusalStatus::kTooFewTracks, "neighbouring keyframes share");
  testing::expectRefusal(runOn(moving(), *load("max_sigma_gyro_rps = 1e-12")).result,
                         RefusalStatus::kIllConditioned, "too little parallax");
  const SyntheticWindowOptions noisy = testing::noisyOptions(Motion::kAggressive, 0.0, ImuBias());
  testing::expectRefusal(runOn(noisy, *load("max_nec_noise = 0.01")).result,
                         RefusalStatus::kNotConverged, "epipolar residuals");
  SyntheticWindowOptions biased = moving();
  biased.bias.gyro = testing::kBiases.gyro;
  const InitializationResult far = runOn(biased, *load("max_gyro_bias_rps = 0.05")).result;
  testing::expectRefusal(far, RefusalStatus::kImplausible, "from its prior mean");
  EXPECT_NEAR(*far.error().value, biased.bias.gyro.norm(), 1e-4);
}

TEST(StereoNec, RefusesForTheReasonsOfTheMapAndOfTheTranslations) {
  testing::expectRefusal(runOn(moving(), *load("max_iterations = 1")).result,
                         RefusalStatus::kNotConverged, "did not converge");
  testing::expectRefusal(runOn(moving(), *load("max_sigma_gravity_deg = 0")).result,
                         RefusalStatus::kIllConditioned, "gravity direction");
  testing::expectRefusal(runOn(moving(), *load("min_inliers = 100000")).result,
                         RefusalStatus::kTooFewTracks,
                         "agree with the translation of the weakest keyframe");
}

TEST(StereoNec, RefusesAnImuGapAndNonFiniteMeasurements) {
  testing::expectRefusesBrokenInput(*load());
}

TEST(StereoNec, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30);
}

}  // namespace
}  // namespace etalon
