#include "etalon/imu/imu_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "analytic_motion.h"

namespace etalon {
namespace {

constexpr double kSeconds = 2.25;  // a window

/** A window of the analytic motion with white noise of this density on the accelerometer. */
std::vector<ImuSample> window(double density, double rate_hz = 200.0) {
  const AnalyticMotion motion;
  std::mt19937_64 random(7);
  std::normal_distribution<double> white(0.0, 1.0);
  std::vector<ImuSample> samples;
  for (int k = 0; k <= static_cast<int>(kSeconds * rate_hz); ++k) {
    samples.push_back(motion.sample(durationNs(k / rate_hz)));
    for (int axis = 0; axis < 3; ++axis)
      samples.back().accel[axis] += density * std::sqrt(rate_hz) * white(random);
  }
  return samples;
}

/**
 * Three standard errors of the density: third differences of white noise are correlated by 15/20,
 * 6/20 and 1/20, so that the 1350 numbers of a window at 200 Hz tell as much as 1350 / 2.31.
 */
constexpr double kTolerance = 3.0 * 0.5 * 0.0585;

double believedFactor(const ImuNoiseOptions& options, double shown_factor) {
  const ImuNoiseDensities sheet;
  return options.apply(sheet, window(shown_factor * sheet.accel_noise_density))
             .accel_noise_density /
         sheet.accel_noise_density;
}

TEST(ImuNoiseOptions, ScalesWhiteNoiseAndLeavesTheRandomWalks) {
  const ImuNoiseDensities data_sheet;
  ImuNoiseOptions options;
  options.gyro_noise_factor = 2.0;
  options.accel_noise_factor = 8.0;
  const ImuNoiseDensities used = options.apply(data_sheet);
  EXPECT_DOUBLE_EQ(used.gyro_noise_density, 2.0 * data_sheet.gyro_noise_density);
  EXPECT_DOUBLE_EQ(used.accel_noise_density, 8.0 * data_sheet.accel_noise_density);
  EXPECT_EQ(used.gyro_random_walk, data_sheet.gyro_random_walk);
  EXPECT_EQ(used.accel_random_walk, data_sheet.accel_random_walk);
}

TEST(ImuNoiseOptions, BelievesWhatTheWindowShowsBetweenItsTwoFactors) {
  ImuNoiseOptions options;
  options.min_accel_noise_factor = 3.0;
  options.accel_noise_factor = 6.0;
  EXPECT_DOUBLE_EQ(believedFactor(options, 0.0), 3.0);
  EXPECT_DOUBLE_EQ(believedFactor(options, 1.0), 3.0);  // as the data sheet has it
  EXPECT_NEAR(believedFactor(options, 4.5), 4.5, 4.5 * kTolerance);
  EXPECT_DOUBLE_EQ(believedFactor(options, 40.0), 6.0);  // in flight
  const ImuNoiseDensities sheet;
  const ImuNoiseDensities used = options.apply(sheet, window(0.0));
  EXPECT_EQ(used.gyro_noise_density, options.gyro_noise_factor * sheet.gyro_noise_density);
  EXPECT_EQ(used.accel_random_walk, sheet.accel_random_walk);
}

TEST(ImuNoiseOptions, TheFactorIsFixedIfTheLeastIsNoLess) {
  const ImuNoiseDensities sheet;
  ImuNoiseOptions options;
  for (const double factor : {1.0, 3.0}) {  // 1: the papers' conditions
    options.accel_noise_factor = factor;
    for (const double shown : {0.0, 1.0, 40.0})
      EXPECT_EQ(options.apply(sheet, window(shown * sheet.accel_noise_density)).accel_noise_density,
                options.apply(sheet).accel_noise_density);
  }
}

TEST(ShownAccelNoiseDensity, IsThatOfWhiteNoiseAtAnyRate) {
  for (const double rate_hz : {100.0, 200.0, 1000.0})
    EXPECT_NEAR(shownAccelNoiseDensity(window(0.01, rate_hz)), 0.01,
                0.01 * kTolerance * std::sqrt(200.0 / std::min(200.0, rate_hz)));
}

TEST(ShownAccelNoiseDensity, HardlySeesMotion) {
  EXPECT_LT(shownAccelNoiseDensity(window(0.0)), 0.05 * ImuNoiseDensities().accel_noise_density);
}

TEST(ShownAccelNoiseDensity, LeavesOutInterpolatedEndsAndGaps) {
  std::vector<ImuSample> samples = window(0.01);
  const double before = shownAccelNoiseDensity(samples);
  samples.front().accel += Eigen::Vector3d::Constant(5.0);
  samples.back().accel -= Eigen::Vector3d::Constant(5.0);
  EXPECT_EQ(shownAccelNoiseDensity(samples), before);
  samples.erase(samples.begin() + 100, samples.begin() + 200);
  EXPECT_NEAR(shownAccelNoiseDensity(samples), before, before * kTolerance);
}

TEST(ShownAccelNoiseDensity, FewSamplesShowNothingAndVibrationIsAssumed) {
  std::vector<ImuSample> samples = window(0.002);
  samples.resize(20);
  EXPECT_TRUE(std::isinf(shownAccelNoiseDensity(samples)));
  EXPECT_TRUE(std::isinf(shownAccelNoiseDensity({})));
  const ImuNoiseOptions options;
  const ImuNoiseDensities sheet;
  EXPECT_EQ(options.apply(sheet, samples).accel_noise_density,
            options.accel_noise_factor * sheet.accel_noise_density);
}

}  // namespace
}  // namespace etalon
