#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/initializer_checks.h"

namespace etalon {
namespace {

using testing::kBiases;
using testing::Motion;
using testing::Outcome;
using testing::runOn;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

const std::string kToTheEnd = "\npasses = 30\nconverged_rps = 1e-9";

Initializer::Ptr load(const std::string& ini = "") {
  return testing::loadInitializer(ETALON_INITIALIZER, ini);
}

SyntheticWindowOptions noisy(Motion motion, double outlier_share) {
  return testing::noisyOptions(motion, outlier_share, {kBiases.gyro, {0.05, -0.04, 0.03}});
}

/**
 * Priors so weak that they do not pull on noise-free data. Without priors, gravity and its mirror
 * image with a b_a of 2 g explain a rotation about the vertical equally well.
 */
SyntheticWindowOptions hardlyAnyPriors(Motion motion) {
  SyntheticWindowOptions options = testing::freeOptions(motion, kBiases);
  options.priors.sigma_accel_mps2 = 30.0;
  return options;
}

TEST(JointClosedForm, IsExactWithoutNoise) {
  for (const char* ini : {"", "imu_noise = no", "frame_stride = 2"})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::string(ini) + " " + testing::toString(motion));
      testing::expectWithin(runOn(hardlyAnyPriors(motion), *load(ini + kToTheEnd)),
                            testing::kNumericalPrecision);
    }
}

TEST(JointClosedForm, IsExactInTheFormPublishedWhereTheAccelerometerBiasIsKnown) {
  for (const Motion motion : testing::kAllMotions) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options = hardlyAnyPriors(motion);
    options.priors.mean.accel = kBiases.accel;
    testing::expectWithin(runOn(options, *load("imu_noise = no\naccel_bias = mean" + kToTheEnd)),
                          testing::kNumericalPrecision);
  }
}

TEST(JointClosedForm, IsExactWithItsDefaultsWhereThePriorsAreTrue) {
  testing::expectExactWhereThePriorsAreTrue(*load());
}

TEST(JointClosedForm, FindsBiasesOfEitherSign) {
  for (const double sign : {-1.0, 1.0}) {
    SyntheticWindowOptions options;
    options.motion = Motion::kAggressive;
    options.bias = {sign * kBiases.gyro, sign * kBiases.accel};
    const Outcome o = runOn(options, *load());
    ASSERT_TRUE(o.result) << o.result.error().reason;
    // The prior of 0.1 m/s^2 pulls b_a, and gravity with it.
    EXPECT_LT((o.result->bias.gyro - options.bias.gyro).norm(), 5e-4);
    EXPECT_LT((o.result->bias.accel - options.bias.accel).norm(), 0.05);
  }
}

TEST(JointClosedForm, NeedsNoVisualOdometry) {
  const SyntheticWindowOptions options;
  const SyntheticWindow window = testing::makeSyntheticWindow(options);
  const Initializer::Ptr initializer = load();
  EXPECT_FALSE(initializer->needsVisualSolution());
  const InitializationProblem problem = makeProblem(window, options);
  EXPECT_TRUE(initializer->initialize(problem));
  EXPECT_FALSE(problem.visualSolutionComputed());
}

TEST(JointClosedForm, IsAccurateOnNoisyDataWithOutliers) {
  for (const double share : {0.0, 0.1, 0.3})
    for (const Motion motion : testing::kExcitingMotions) {
      SCOPED_TRACE(std::to_string(share) + " " + testing::toString(motion));
      const Outcome o = runOn(noisy(motion, share), *load());
      ASSERT_TRUE(o.result) << o.result.error().reason;
      // Three to five times the Cramer-Rao bounds of such a window, because this is one draw and
      // not a mean. With 30 % of outlying pixels half of the stereo pairs are broken.
      EXPECT_LT(o.errors.rre_deg, share < 0.2 ? 0.04 : 0.08);
      EXPECT_LT(o.errors.velocity_mps, share < 0.2 ? 0.02 : 0.04);
      EXPECT_LT(o.errors.gyro_bias_rps, 3e-3);
      EXPECT_LT(o.errors.gravity_deg, 1.5);
    }
}

TEST(JointClosedForm, ErrsInProportionToThePixelNoise) {
  // With derivatives at the measured direction the errors are 0.0071 and 0.0248 m/s.
  testing::expectErrsInProportionToThePixelNoise(*load());
}

TEST(JointClosedForm, ErrsAsItsCovarianceSays) {
  testing::expectErrsAsItsCovarianceSays(*load(), 0.05);
}

TEST(JointClosedForm, ErrsAsItsCovarianceSaysInTheFormsPublished) {
  for (const char* ini : {"imu_noise = no", "accel_bias = mean"}) {
    SCOPED_TRACE(ini);
    testing::expectErrsAsItsCovarianceSays(*load(ini), 0.05, 30);
  }
}

/** At rest b_a and tilt are one unknown; their sum and the vertical b_a are known. */
TEST(JointClosedForm, AcceptsEveryStandstillAndSaysThatTiltIsTheAccelerometerBias) {
  double sum = 0.0;
  constexpr int kWindows = 40;
  for (unsigned seed = 1; seed <= kWindows; ++seed) {
    const SyntheticWindowOptions options =
        testing::drawnOptions(Motion::kStandstill, seed, seed % 2 == 0 ? 0.05 : 0.5);
    const Outcome o = runOn(testing::withoutBiasWalk(options), options, *load());
    ASSERT_TRUE(o.result) << "seed " << seed << ": " << o.result.error().reason;
    const Eigen::Vector2d tilt = testing::estimationError(*o.result, o.window).segment<2>(6);
    const Eigen::MatrixXd& P = o.result->covariance;
    ASSERT_EQ(P.rows(), 11 + 6 * (options.keyframes - 1));
    const Eigen::Matrix2d P_tilt = P.block<2, 2>(6, 6);
    sum += squaredMahalanobis(tilt, P_tilt) / (2.0 * kWindows);
    const double prior = options.priors.sigma_accel_mps2 / 9.81;
    for (int axis = 0; axis < 2; ++axis)
      EXPECT_NEAR(std::sqrt(P_tilt(axis, axis)), prior, 0.02 * prior);
    // With b_a given the tilt is known 20 times better.
    const Eigen::Matrix2d given =
        P_tilt - P.block<2, 3>(6, 3) * P.block<3, 3>(3, 3).llt().solve(P.block<3, 2>(3, 6));
    EXPECT_LT(std::sqrt(given.trace()), 0.05 * std::sqrt(P_tilt.trace()));
  }
  EXPECT_NEAR(sum, 1.0, 3.29 * std::sqrt(2.0 / (2.0 * kWindows)));
}

TEST(JointClosedForm, LeavesOutLandmarksThatTheRightCameraNeverSees) {
  const SyntheticWindowOptions options;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.has_right = o.has_right && o.id % 2 == 0;
  const Outcome o = runOn(window, options, *load());
  testing::expectWithin(o, testing::kNumericalPrecision);
  EXPECT_GT(o.result->landmarks.size(), 50U);
  for (const auto& [id, p_W] : o.result->landmarks) EXPECT_EQ(id % 2, 0);
}

TEST(JointClosedForm, GivesTheSameResultBitForBit) {
  testing::expectSameBits([] { return load(); }, noisy(Motion::kAggressive, 0.1));
}

TEST(JointClosedForm, RefusesAWindowWithoutRightImages) {
  const SyntheticWindowOptions options;
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : window.frames)
    for (Observation& o : frame.observations) o.has_right = false;
  const InitializationResult result = runOn(window, options, *load()).result;
  EXPECT_EQ(result.error().status, RefusalStatus::kTooFewTracks);
  EXPECT_EQ(*result.error().value, 0.0);
}

TEST(JointClosedForm, RefusesTracksThatDisagreeWithTheImu) {
  const Outcome o = runOn(noisy(Motion::kAggressive, 0.9), *load());
  EXPECT_FALSE(o.result);
  EXPECT_FALSE(o.result.error().reason.empty());
}

TEST(JointClosedForm, RefusesTooFewTracksInWords) {
  testing::expectRefusesTooFewTracks(*load());
  testing::expectRefusal(runOn(SyntheticWindowOptions(), *load("min_landmarks = 100000")).result,
                         RefusalStatus::kTooFewTracks, "a depth from both cameras");
}

TEST(JointClosedForm, RefusesWhatDoesNotComeToRestOrIsNotKnownWellEnough) {
  const SyntheticWindowOptions options = noisy(Motion::kAggressive, 0.1);
  testing::expectRefusal(runOn(options, *load("passes = 2\nconverged_rps = 1e-12")).result,
                         RefusalStatus::kNotConverged, "linear solutions");
  testing::expectRefusal(runOn(options, *load("max_sigma_gravity_deg = 0")).result,
                         RefusalStatus::kIllConditioned, "gravity direction");
  const InitializationResult share = runOn(options, *load("min_inlier_share = 1")).result;
  testing::expectRefusal(share, RefusalStatus::kNotConverged, "agree with the solution");
  EXPECT_NEAR(*share.error().value, 0.9, 0.03);  // a tenth are outliers
}

TEST(JointClosedForm, SaysThatThePixelsAreNoisierThanBelieved) {
  SyntheticWindowOptions options = noisy(Motion::kAggressive, 0.0);
  options.sigma_px = 10.0 * options.assumed_sigma_px;
  const InitializationResult result = runOn(options, *load()).result;
  testing::expectRefusal(result, RefusalStatus::kNotConverged, "what sigma_px promises");
  EXPECT_NEAR(*result.error().value, 10.0, 3.0);  // landmarks take their share, outliers add theirs
  EXPECT_NEAR(*result.error().bound, std::sqrt(5.991), 1e-12);
}

/** Values with which no window can succeed are out of range. */
TEST(JointClosedForm, HasNoKeyThatRefusesEveryWindow) {
  EXPECT_THROW(load("passes = 1"), ConfigError);
  EXPECT_THROW(load("chi2_pixel = 0.5"), ConfigError);
}

TEST(JointClosedForm, RefusesAnAccelerometerThatShowsNoGravity) {
  testing::expectRefusesAnAccelerometerThatShowsNoGravity(*load());
}

TEST(JointClosedForm, RefusesAnImuGapAndNonFiniteMeasurements) {
  testing::expectRefusesBrokenInput(*load());
}

}  // namespace
}  // namespace etalon
