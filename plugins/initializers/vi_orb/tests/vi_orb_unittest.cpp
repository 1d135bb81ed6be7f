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

const std::string kWeighted = "weighted = true\n", kConverged = "gravity_passes = 10\n";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

TEST(ViOrb, IsExactWithoutNoiseWithBothBiasesUnknown) {
  for (const char* ini : {"", "weighted = true", "free_scale = true"})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      SyntheticWindowOptions options = testing::freeOptions(motion, kBiases);
      options.priors.sigma_accel_mps2 = 1e3;
      testing::expectWithin(runOn(options, *load("gyro_passes = 5\n" + kConverged + ini)),
                            testing::kNumericalPrecision);
    }
}

/** Without b_a in the first equations gravity is off by |b_a| / g = 1 deg; one linear step leaves
 * its square. */
TEST(ViOrb, OnePassLeavesTheSquareOfTheFirstGravitysError) {
  SyntheticWindowOptions options = testing::freeOptions(Motion::kAggressive, kBiases);
  const Outcome once = runOn(options, *load("gyro_passes = 5"));
  ASSERT_TRUE(once.result) << once.result.error().reason;
  EXPECT_GT(once.errors.gravity_deg, 1e-5);
  EXPECT_LT(once.errors.gravity_deg, 0.05);
}

/** A calibration with too short a baseline makes stereo odometry's path too short: an unknown scale
 * finds the true one, a fixed one bends gravity and b_a. */
TEST(ViOrb, AFreeScaleFindsThatOfTheImu) {
  SyntheticWindowOptions options = testing::freeOptions(Motion::kAggressive, kBiases);
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  SE3& right = window.calibration.cameras[1].T_BC;
  const Eigen::Vector3d left = window.calibration.cameras[0].T_BC.t;
  right.t = left + 0.9 * (right.t - left);
  const auto scaleError = [&](const std::string& ini) {
    return runOn(window, options, *load("gyro_passes = 5\n" + kConverged + ini)).errors.scale_error;
  };
  EXPECT_GT(std::abs(scaleError("")), 0.09);
  EXPECT_LT(std::abs(scaleError("free_scale = true")), 1e-3);
}

TEST(ViOrb, WeightsAndThePriorTakeNoiseFromTheBias) {
  const SyntheticWindowOptions options =
      testing::noisyOptions(Motion::kAggressive, 0.0, {kBiases.gyro, {0.05, -0.04, 0.03}});
  const Outcome plain = runOn(options, *load()), weighted = runOn(options, *load(kWeighted));
  ASSERT_TRUE(plain.result && weighted.result);
  const auto variance = [](const Outcome& o) {
    return o.result->covariance.diagonal().segment<3>(3).sum();
  };
  EXPECT_LT(variance(weighted), 0.5 * variance(plain));
}

TEST(ViOrb, SurvivesThirtyPercentOfOutliers) {
  testing::expectSurvivesOutliersOfStereoOdometry(*load());
}

TEST(ViOrb, ErrsAsItsCovarianceSays) { testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30); }

TEST(ViOrb, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); },
                          testing::noisyOptions(Motion::kAggressive, 0.1, kBiases));
}

TEST(ViOrb, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesBrokenInput(*load());
  SyntheticWindowOptions options;
  options.keyframes = 3;  // one triple for five unknowns
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "3 keyframes do not tell gravity from the accelerometer's bias");
  options.keyframes = 10;
  options.motion = Motion::kConstantVelocity;  // no turn: b_a and tilt are one unknown
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "condition number");
}

}  // namespace
}  // namespace etalon
