#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::kBiases;
using testing::Motion;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindowOptions;

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(Edi, IsExactWithoutNoiseWithBothBiasesUnknown) {
  for (const char* ini : {"", "weighted = false", "free_scale = true"})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      SyntheticWindowOptions options = testing::freeOptions(motion, kBiases);
      options.priors.sigma_accel_mps2 = 1e3;
      testing::expectWithin(
          runOn(options, *load(std::string("filter_passes = 10\ngravity_passes = 10\n") + ini)),
          testing::kNumericalPrecision);
    }
}

TEST(Edi, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(Edi, WeightsAndThePriorTakeNoiseFromTheBias) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.0, {kBiases.gyro, {0.05, -0.04, 0.03}});
  const Outcome plain = runOn(options, *load("weighted = false")),
                weighted = runOn(options, *load());
  ASSERT_TRUE(plain.result && weighted.result);
  const auto variance = [](const Outcome& o) {
    return o.result->covariance.diagonal().segment<3>(3).sum();
  };
  EXPECT_LT(variance(weighted), 0.7 * variance(plain));
}

TEST(Edi, SurvivesThirtyPercentOfOutliers) {
  testing::expectSurvivesOutliersOfStereoOdometry(*load());
}

TEST(Edi, ErrsAsItsCovarianceSays) { testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30); }

TEST(Edi, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); },
                          testing::noisyOptions(Motion::kAggressive, 0.1, kBiases));
}

TEST(Edi, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesBrokenInput(*load());
  SyntheticWindowOptions options;
  options.keyframes = 2;
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "2 keyframes do not tell gravity");
}

}  // namespace
}  // namespace etalon
