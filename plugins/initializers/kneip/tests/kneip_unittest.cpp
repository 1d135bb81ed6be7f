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

TEST(Kneip, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(Kneip, IsExactWithoutNoiseWhereTheAccelerometerBiasIsKnown) {
  for (const char* ini : {"", "free_scale = true"})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      SyntheticWindowOptions options;
      options.motion = motion;
      options.bias = kBiases;
      options.priors.mean.accel = kBiases.accel;
      testing::expectWithin(runOn(options, *load(std::string("gyro_passes = 5\n") + ini)),
                            testing::kNumericalPrecision);
    }
}

/** A baseline that is said to be a tenth too short makes stereo odometry's path too short. */
TEST(Kneip, AFreeScaleIsThatAtWhichGravityHasItsMagnitude) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  SE3& right = window.calibration.cameras[1].T_BC;
  const Eigen::Vector3d left = window.calibration.cameras[0].T_BC.t;
  right.t = left + 0.9 * (right.t - left);
  EXPECT_GT(std::abs(runOn(window, options, *load()).errors.scale_error), 0.09);
  EXPECT_LT(std::abs(runOn(window, options, *load("free_scale = true")).errors.scale_error), 1e-3);
}

TEST(Kneip, ErrsAsItsCovarianceSaysWithAFreeScaleToo) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.1, 30);
  testing::expectErrsAsItsCovarianceSays(*load("free_scale = true"), 0.1, 30);
}

TEST(Kneip, LeavesTheAccelerometerBiasToGravity) {
  SyntheticWindowOptions options;
  options.bias = kBiases;  // the prior's mean is zero
  const Outcome o = runOn(options, *load());
  ASSERT_TRUE(o.result) << o.result.error().reason;
  EXPECT_EQ(o.result->bias.accel, Eigen::Vector3d::Zero());
  EXPECT_LT(o.errors.gyro_bias_rps, 1e-5);
  EXPECT_GT(o.errors.gravity_deg, 0.1);
  EXPECT_LT(o.errors.gravity_deg, 1.1);  // |b_a| / g is 1.02 deg
}

TEST(Kneip, SurvivesThirtyPercentOfOutliers) {
  testing::expectSurvivesOutliersOfStereoOdometry(*load());
}

TEST(Kneip, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); },
                          testing::noisyOptions(Motion::kAggressive, 0.1, kBiases));
}

TEST(Kneip, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesBrokenInput(*load());
  SyntheticWindowOptions options;
  testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& sample : samples) sample.accel *= 1.3;
  window.imu = ImuBuffer(samples);
  testing::expectRefusal(runOn(window, options, *load()).result, RefusalStatus::kImplausible,
                         "away from its magnitude");
  options.keyframes = 2;
  testing::expectRefusal(runOn(options, *load()).result, RefusalStatus::kIllConditioned,
                         "2 keyframes have no change of velocity");
}

}  // namespace
}  // namespace etalon
