#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::kBiases;
using testing::Motion;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindowOptions;

/** The windows' pixels share no error, and none is believed. */
const std::string kExactCameras = "sigma_shared_deg = 0\nsigma_turn_deg = 0";
const std::string kToTheEnd = "\npasses = 30\nconverged_rps = 1e-9";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

/** Believes in a slow error of the accelerometer; without noise it makes none. */
SyntheticWindowOptions withSlowError(SyntheticWindowOptions options) {
  options.priors.slow_accel = {0.02, 0.68};
  return options;
}

TEST(Etalon, IsExactWithoutNoise) {
  for (const char* ini : {"", "frame_stride = 2", kExactCameras.c_str()})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      // Priors that hardly say anything, so that they do not pull; without any, gravity and its
      // mirror image explain a rotation about the vertical equally well.
      SyntheticWindowOptions options = testing::freeOptions(motion, kBiases);
      options.priors.sigma_accel_mps2 = 30.0;
      for (const SyntheticWindowOptions& window : {options, withSlowError(options)})
        testing::expectWithin(runOn(window, *load(ini + kToTheEnd)), testing::kNumericalPrecision);
    }
}

TEST(Etalon, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(Etalon, NeedsNoVisualOdometry) { EXPECT_FALSE(load()->needsVisualSolution()); }

TEST(Etalon, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(kExactCameras), 0.05);
}

/** Pixels of 0.1 px that are believed to have 0.5: what is known is what is right for 0.1. */
TEST(Etalon, KnowsWhatItsResidualsShow) {
  SyntheticWindowOptions options = testing::drawnOptions(Motion::kAggressive, 1, 0.1);
  const Outcome right = runOn(options, *load(kExactCameras));
  options.assumed_sigma_px = 0.5;
  const Outcome shown = runOn(options, *load(kExactCameras)),
                believed = runOn(options, *load(kExactCameras + "\nleast_pixel_share = 1"));
  ASSERT_TRUE(right.result && shown.result && believed.result);
  const auto variance = [](const Outcome& o) {
    return o.result->covariance.diagonal().segment<3>(8).sum();  // of the velocity
  };
  EXPECT_NEAR(variance(shown) / variance(right), 1.0, 0.1);
  EXPECT_GT(variance(believed), 2.0 * variance(right));
}

/** A slow error and noise that all pixels share are not in the window: who believes in them knows
 * less, and says so. */
TEST(Etalon, KnowsLessWhereMoreErrorsAreBelieved) {
  const SyntheticWindowOptions options = testing::drawnOptions(Motion::kAggressive, 1, 0.3);
  SyntheticWindowOptions with_slow = options;
  with_slow.priors.slow_accel = {0.03, 0.68};
  const Outcome plain = runOn(options, *load(kExactCameras)),
                slow = runOn(with_slow, *load(kExactCameras)),
                shared = runOn(options, *load("sigma_shared_deg = 0.05\nsigma_turn_deg = 0"));
  ASSERT_TRUE(plain.result && slow.result && shared.result);
  const auto variance = [](const Outcome& o, int first) {
    return o.result->covariance.diagonal().segment<2>(first).sum();
  };
  EXPECT_GT(variance(slow, 6), 1.5 * variance(plain, 6));    // tilt
  EXPECT_GT(variance(shared, 0), 1.5 * variance(plain, 0));  // b_g
  EXPECT_NEAR(variance(slow, 0) / variance(plain, 0), 1.0, 0.2);
}

/** Cameras that are turned in the body by 0.2 deg an axis against the calibration: who believes in that
 * keeps the gyro's rotations, and the errors are those of the covariance. */
TEST(Etalon, BearsCamerasThatAreTurnedInTheBody) {
  constexpr int kWindows = 20;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, radians(0.2));
  double exact_deg = 0.0, turned_deg = 0.0, nees = 0.0;
  for (unsigned seed = 1; seed <= kWindows; ++seed) {
    const SyntheticWindowOptions options = testing::drawnOptions(Motion::kAggressive, seed, 0.1);
    testing::SyntheticWindow window = testing::withoutBiasWalk(options);
    const Eigen::Vector3d turn(normal(random), normal(random), normal(random));
    for (CameraCalibration& camera : window.calibration.cameras)
      camera.T_BC = SE3(expSO3(turn), Eigen::Vector3d::Zero()) * camera.T_BC;
    const Outcome exact = runOn(window, options, *load(kExactCameras)),
                  turned =
                      runOn(window, options, *load("sigma_shared_deg = 0\nsigma_turn_deg = 0.2"));
    ASSERT_TRUE(exact.result) << exact.result.error().reason;
    ASSERT_TRUE(turned.result) << turned.result.error().reason;
    exact_deg += exact.errors.rre_deg / kWindows;
    turned_deg += turned.errors.rre_deg / kWindows;
    const Eigen::Vector3d e = testing::estimationError(*turned.result, turned.window).segment<3>(8);
    nees += squaredMahalanobis(e, turned.result->covariance.block<3, 3>(8, 8)) / 3.0 / kWindows;
  }
  EXPECT_LT(turned_deg, 0.5 * exact_deg);
  EXPECT_NEAR(nees, 1.0, 3.0 * std::sqrt(2.0 / 3.0 / kWindows));  // of the velocity
}

/** At rest b_a and tilt are one unknown: both are known to the prior, with either model. */
TEST(Etalon, AcceptsStandstillAndSaysThatTiltIsTheAccelerometerBias) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const SyntheticWindowOptions drawn =
        testing::drawnOptions(Motion::kStandstill, seed, seed % 2 == 0 ? 0.05 : 0.5);
    for (const SyntheticWindowOptions& options : {drawn, withSlowError(drawn)}) {
      const Outcome o = runOn(testing::withoutBiasWalk(options), options, *load());
      ASSERT_TRUE(o.result) << "seed " << seed << ": " << o.result.error().reason;
      const double prior =
          std::hypot(options.priors.sigma_accel_mps2, options.priors.slow_accel.sigma_mps2) / 9.81;
      for (int axis = 6; axis < 8; ++axis)
        EXPECT_NEAR(std::sqrt(o.result->covariance(axis, axis)), prior, 0.03 * prior);
    }
  }
}

TEST(Etalon, SurvivesOutliers) {
  for (const Motion motion : testing::kExcitingMotions) {
    SCOPED_TRACE(testing::toString(motion));
    const Outcome o = runOn(
        withSlowError(testing::noisyOptions(motion, 0.1, {kBiases.gyro, {0.05, -0.04, 0.03}})),
        *load());
    ASSERT_TRUE(o.result) << o.result.error().reason;
    // Those of joint_closed_form: three to five times the Cramer-Rao bounds, one draw, not a mean.
    EXPECT_LT(o.errors.rre_deg, 0.04);
    EXPECT_LT(o.errors.velocity_mps, 0.02);
    EXPECT_LT(o.errors.gravity_deg, 1.5);
  }
}

/** Parallax that is noise is no information: at infinity nothing is known, at 30 m what is said. */
TEST(Etalon, RefusesLandmarksThatAreTooFarAndKnowsHowLittleFarOnesSay) {
  double nees = 0.0;
  int claiming = 0;
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (const double distance_m : {30.0, 1e6}) {
      SyntheticWindowOptions options = testing::drawnOptions(Motion::kAggressive, seed, 0.3);
      options.landmark_distance_m = distance_m;
      options.landmarks = 120;
      const Outcome o = runOn(testing::withoutBiasWalk(options), options, *load(kExactCameras));
      if (distance_m == 1e6) {
        ASSERT_FALSE(o.result) << "seed " << seed;
        EXPECT_EQ(o.result.error().status, RefusalStatus::kIllConditioned);
        EXPECT_NE(o.result.error().reason.find("too far away"), std::string::npos);
      } else if (o.result) {
        const Eigen::Vector3d e = testing::estimationError(*o.result, o.window).segment<3>(8);
        nees += squaredMahalanobis(e, o.result->covariance.block<3, 3>(8, 8)) / 3.0;
        ++claiming;
      }
    }
  ASSERT_GE(claiming, 10);
  EXPECT_LT(nees / claiming, 1.5);
}

TEST(Etalon, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); },
                          withSlowError(testing::noisyOptions(Motion::kAggressive, 0.1, kBiases)));
}

TEST(Etalon, RefusesInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusesAnAccelerometerThatShowsNoGravity(*load());
  testing::expectRefusesBrokenInput(*load());
}

}  // namespace
}  // namespace etalon
