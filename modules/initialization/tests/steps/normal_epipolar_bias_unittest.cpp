#include "etalon/initialization/steps/normal_epipolar_bias.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/symmetric.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

NormalEpipolarBias estimate(const SyntheticWindowOptions& window_options,
                            NormalEpipolarBiasOptions options = {}, Vector3d seed = {0, 0, 0}) {
  const SyntheticWindow window = testing::makeSyntheticWindow(window_options);
  const std::vector<const TrackedFrame*> keyframes = window.keyframes();
  std::vector<Preintegration> preintegrations;
  for (size_t k = 1; k < keyframes.size(); ++k)
    preintegrations.emplace_back(window.imu.between(keyframes[k - 1]->t, keyframes[k]->t),
                                 ImuBias{seed, {0, 0, 0}}, window.calibration.imu.noise);
  options.sigma_px = window_options.assumed_sigma_px;
  return estimateGyroBias(window.calibration, keyframes, preintegrations, seed, options);
}

const Vector3d kGyroBias(0.02, -0.06, 0.04);

TEST(NormalEpipolarBias, IsExactOnNoiseFreeDataWhateverTheMotionAndTheOptions) {
  for (const Motion motion : testing::kAllMotions)
    for (const bool all_pairs : {true, false})
      for (const bool noise_weighted : {true, false}) {
        SCOPED_TRACE(std::string(testing::toString(motion)) + (all_pairs ? " all" : " neighbours") +
                     (noise_weighted ? " weighted" : " published"));
        SyntheticWindowOptions window;
        window.motion = motion;
        window.bias.gyro = kGyroBias;  // the sign, too
        NormalEpipolarBiasOptions options;
        options.all_pairs = options.both_cameras = all_pairs;
        options.noise_weighted = noise_weighted;
        const NormalEpipolarBias found = estimate(window, options);
        ASSERT_TRUE(found.summary.usable()) << found.summary.message;
        EXPECT_LT((found.gyro - kGyroBias).norm(), 1e-6) << found.gyro.transpose();
        EXPECT_EQ(found.rotation_only, motion == Motion::kStandstill);
        EXPECT_EQ(found.inlier_share, 1.0);
      }
}

TEST(NormalEpipolarBias, KeepsItsAccuracyWithNoiseAndThirtyPercentOutliers) {
  for (const Motion motion : {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                              Motion::kConstantVelocity, Motion::kStandstill})
    for (const unsigned seed : {1U, 2U, 3U}) {
      SCOPED_TRACE(std::string(testing::toString(motion)) + " " + std::to_string(seed));
      SyntheticWindowOptions window;
      window.motion = motion;
      window.seed = seed;
      window.bias.gyro = kGyroBias;
      window.sigma_px = window.assumed_sigma_px = 0.5;
      window.gyro_noise_factor = 1.5;
      // Of observations: of matches it makes 30 % (1 - 0.84^2).
      window.outlier_share = 0.16;
      const NormalEpipolarBias found = estimate(window);
      ASSERT_TRUE(found.summary.usable()) << found.summary.message;
      EXPECT_LT((found.gyro - kGyroBias).norm(), 3e-3);
      EXPECT_NEAR(found.noise, 1.0, 0.5);
      // Three degrees of freedom, one draw: 99.9 % is 16.3; the covariance is approximate.
      EXPECT_LT(squaredMahalanobis(found.gyro - kGyroBias, found.covariance), 30.0);
    }
}

TEST(NormalEpipolarBias, FindsALargeBiasFromAFarSeed) {
  SyntheticWindowOptions window;
  window.motion = Motion::kAggressive;
  window.bias.gyro = {0.2, -0.15, 0.25};
  window.sigma_px = window.assumed_sigma_px = 0.5;
  const NormalEpipolarBias found = estimate(window);
  ASSERT_TRUE(found.summary.usable()) << found.summary.message;
  EXPECT_LT((found.gyro - window.bias.gyro).norm(), 3e-3);
}

TEST(NormalEpipolarBias, RefusesWindowsWithoutMatchesBetweenNeighbours) {
  NormalEpipolarBiasOptions options;
  options.min_matches = 100000;
  EXPECT_EQ(estimate({}, options).summary.termination, Termination::kNotStarted);
}

TEST(NormalEpipolarBias, GivesTheSameResultBitForBit) {
  SyntheticWindowOptions window;
  window.sigma_px = 0.5;
  window.outlier_share = 0.1;
  EXPECT_EQ(estimate(window).gyro, estimate(window).gyro);
}

/** A window in motion that stands still in its last interval. */
TEST(NormalEpipolarBias, AStopAtTheEndIsNoWindowAtRest) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    SyntheticWindowOptions options;
    options.motion = Motion::kAggressive;
    options.seed = seed;
    options.bias.gyro = kGyroBias;
    options.sigma_px = options.assumed_sigma_px = 0.1;
    SyntheticWindow window = testing::makeSyntheticWindow(options);
    std::vector<const TrackedFrame*> keyframes = window.keyframes();
    std::vector<Preintegration> preintegrations;
    for (size_t k = 1; k < keyframes.size(); ++k)
      preintegrations.emplace_back(window.imu.between(keyframes[k - 1]->t, keyframes[k]->t),
                                   ImuBias(), window.calibration.imu.noise);
    TrackedFrame stop = *keyframes.back();
    stop.t += 250'000'000;
    std::vector<ImuSample> rest;
    for (TimeNs t = keyframes.back()->t; t <= stop.t; t += 5'000'000)
      rest.push_back({t, kGyroBias, {0.0, 0.0, 9.81}});
    keyframes.push_back(&stop);
    preintegrations.emplace_back(rest, ImuBias(), window.calibration.imu.noise);
    for (const bool all_pairs : {false, true}) {
      NormalEpipolarBiasOptions nec;
      nec.all_pairs = all_pairs;
      nec.sigma_px = options.assumed_sigma_px;
      const NormalEpipolarBias found =
          estimateGyroBias(window.calibration, keyframes, preintegrations, Vector3d::Zero(), nec);
      ASSERT_TRUE(found.summary.usable()) << found.summary.message;
      EXPECT_FALSE(found.rotation_only);
      // 3e-3 rad/s with five times the noise and outliers, above.
      EXPECT_LT((found.gyro - kGyroBias).norm(), 3e-3) << all_pairs << " " << seed;
    }
  }
}

}  // namespace
}  // namespace etalon
