#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
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

const std::string kToTheEnd = "gravity_passes = 10\nhand_eye_passes = 30\n";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

/** A window whose calibration has the rig elsewhere in the body than it is. */
SyntheticWindow movedRig(const SyntheticWindowOptions& options, const SE3& T_true_said) {
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (CameraCalibration& camera : window.calibration.cameras)
    camera.T_BC = T_true_said.inverse() * camera.T_BC;
  return window;
}

TEST(HuangStereo, IsExactWithoutNoiseWhateverTheCalibrationSaysOfTheRigInTheBody) {
  const SE3 moved(expSO3({0.05, -0.1, 0.08}), {0.03, 0.02, -0.04});
  for (const std::string ini : {"", "weighted = true\n"}) {
    SCOPED_TRACE(ini);
    SyntheticWindowOptions options = testing::freeOptions(Motion::kAggressive, kBiases);
    options.priors.sigma_accel_mps2 = 1e3;
    const SyntheticWindow window = movedRig(options, moved);
    const Outcome o = runOn(window, options, *load(kToTheEnd + ini));
    ASSERT_TRUE(o.result) << o.result.error().reason;
    ASSERT_TRUE(o.result->T_BC);
    const SE3 truth = eurocCalibration().cameras[0].T_BC;
    EXPECT_LT(logSO3(truth.R.transpose() * o.result->T_BC->R).norm(), 1e-7);
    EXPECT_LT((truth.t - o.result->T_BC->t).norm(), 1e-5);
    EXPECT_LT(o.errors.gravity_deg, 1e-4);
    EXPECT_LT(o.errors.velocity_mps, 1e-5);
    EXPECT_LT(o.errors.rre_deg, 1e-5);
    EXPECT_LT(o.errors.gyro_bias_rps, 1e-7);
    EXPECT_LT(o.errors.ate_m, 1e-5);
  }
}

TEST(HuangStereo, IsExactWithTheTranslationOfTheCalibration) {
  for (const Motion motion : {Motion::kGentle, Motion::kAggressive}) {
    SyntheticWindowOptions options = testing::freeOptions(motion, kBiases);
    testing::expectWithin(runOn(options, *load(kToTheEnd + "translation = calibration")),
                          testing::kNumericalPrecision);
  }
}

TEST(HuangStereo, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.15, 30);
  testing::expectErrsAsItsCovarianceSays(*load("translation = calibration"), 0.1, 30);
}

TEST(HuangStereo, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load("translation = calibration"); },
                          testing::noisyOptions(Motion::kAggressive, 0.1, kBiases));
}

TEST(HuangStereo, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesBrokenInput(*load());
  SyntheticWindowOptions options;
  options.motion = Motion::kConstantVelocity;
  EXPECT_EQ(runOn(options, *load()).result.error().status, RefusalStatus::kIllConditioned);
}

/** The rig finds its place in the body, and its landmarks go with it: at the stereo camera's scale. */
TEST(HuangStereo, HasNoFreeScale) { EXPECT_THROW(load("free_scale = true"), ConfigError); }

}  // namespace
}  // namespace etalon
