#include "etalon/imu/imu_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "analytic_motion.h"

namespace etalon {
namespace {

constexpr double kSeconds = 2.25;  // a window

using Sensor = Eigen::Vector3d ImuSample::*;
constexpr Sensor kGyro = &ImuSample::gyro, kAccel = &ImuSample::accel;

/** A window of the analytic motion with white noise of this density on a sensor. */
std::vector<ImuSample> window(Sensor sensor, double density, double rate_hz = 200.0) {
  const AnalyticMotion motion;
  std::mt19937_64 random(7);
  std::normal_distribution<double> white(0.0, 1.0);
  std::vector<ImuSample> samples;
  for (int k = 0; k <= static_cast<int>(kSeconds * rate_hz); ++k) {
    samples.push_back(motion.sample(durationNs(k / rate_hz)));
    for (int axis = 0; axis < 3; ++axis)
      (samples.back().*sensor)[axis] += density * std::sqrt(rate_hz) * white(random);
  }
  return samples;
}

/**
 * Three standard errors of the density: third differences of white noise are correlated by 15/20,
 * 6/20 and 1/20, so that the 1350 numbers of a window at 200 Hz tell as much as 1350 / 2.31.
 */
constexpr double kTolerance = 3.0 * 0.5 * 0.0585;

double believedFactor(const ImuNoiseOptions& options, Sensor sensor, double shown_factor) {
  const ImuNoiseDensities sheet;
  const auto density = sensor == kGyro ? &ImuNoiseDensities::gyro_noise_density
                                       : &ImuNoiseDensities::accel_noise_density;
  return options.apply(sheet, window(sensor, shown_factor * sheet.*density)).*density /
         sheet.*density;
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

TEST(ImuNoiseOptions, NoRandomWalkIsZero) {
  ImuNoiseDensities data_sheet;
  data_sheet.gyro_random_walk = data_sheet.accel_random_walk = 0.0;
  const ImuNoiseOptions options;
  for (const ImuNoiseDensities& used :
       {options.apply(data_sheet), options.apply(data_sheet, window(kAccel, 0.002))}) {
    EXPECT_EQ(used.gyro_random_walk, kLeastGyroRandomWalk);
    EXPECT_EQ(used.accel_random_walk, kLeastAccelRandomWalk);
  }
}

TEST(ImuNoiseOptions, BelievesWhatTheWindowShowsBetweenItsTwoFactors) {
  ImuNoiseOptions options;
  options.min_gyro_noise_factor = options.min_accel_noise_factor = 3.0;
  options.gyro_noise_factor = options.accel_noise_factor = 6.0;
  for (const Sensor sensor : {kGyro, kAccel}) {
    SCOPED_TRACE(sensor == kGyro ? "gyro" : "accelerometer");
    EXPECT_DOUBLE_EQ(believedFactor(options, sensor, 0.0), 3.0);
    EXPECT_DOUBLE_EQ(believedFactor(options, sensor, 1.0), 3.0);  // as the data sheet has it
    EXPECT_NEAR(believedFactor(options, sensor, 4.5), 4.5, 4.5 * kTolerance);
    EXPECT_DOUBLE_EQ(believedFactor(options, sensor, 40.0), 6.0);  // in flight
  }
  const ImuNoiseDensities sheet;
  const ImuNoiseDensities used = options.apply(sheet, window(kAccel, 40.0));
  EXPECT_EQ(used.gyro_noise_density, options.min_gyro_noise_factor * sheet.gyro_noise_density);
  EXPECT_EQ(used.accel_random_walk, sheet.accel_random_walk);
}

TEST(ImuNoiseOptions, TheFactorIsFixedIfTheLeastIsNoLess) {
  ImuNoiseOptions options;
  options.min_gyro_noise_factor = options.min_accel_noise_factor = 3.0;
  for (const double factor : {1.0, 3.0}) {  // 1: the papers' conditions
    options.gyro_noise_factor = options.accel_noise_factor = factor;
    for (const Sensor sensor : {kGyro, kAccel})
      for (const double shown : {0.0, 1.0, 40.0})
        EXPECT_DOUBLE_EQ(believedFactor(options, sensor, shown), factor);
  }
}

TEST(ShownNoiseDensity, IsThatOfWhiteNoiseAtAnyRate) {
  for (const double rate_hz : {100.0, 200.0, 1000.0})
    EXPECT_NEAR(shownNoiseDensity(window(kAccel, 0.01, rate_hz), kAccel), 0.01,
                0.01 * kTolerance * std::sqrt(200.0 / std::min(200.0, rate_hz)));
}

TEST(ShownNoiseDensity, HardlySeesMotion) {
  EXPECT_LT(shownNoiseDensity(window(kAccel, 0.0), kAccel),
            0.05 * ImuNoiseDensities().accel_noise_density);
}

TEST(ShownNoiseDensity, LeavesOutInterpolatedEndsAndGaps) {
  std::vector<ImuSample> samples = window(kAccel, 0.01);
  const double before = shownNoiseDensity(samples, kAccel);
  samples.front().accel += Eigen::Vector3d::Constant(5.0);
  samples.back().accel -= Eigen::Vector3d::Constant(5.0);
  EXPECT_EQ(shownNoiseDensity(samples, kAccel), before);
  samples.erase(samples.begin() + 100, samples.begin() + 200);
  EXPECT_NEAR(shownNoiseDensity(samples, kAccel), before, before * kTolerance);
}

TEST(ShownNoiseDensity, FewSamplesShowNothingAndVibrationIsAssumed) {
  std::vector<ImuSample> samples = window(kAccel, 0.002);
  samples.resize(20);
  EXPECT_TRUE(std::isinf(shownNoiseDensity(samples, kAccel)));
  EXPECT_TRUE(std::isinf(shownNoiseDensity({}, kAccel)));
  const ImuNoiseOptions options;
  const ImuNoiseDensities sheet;
  EXPECT_EQ(options.apply(sheet, samples).accel_noise_density,
            options.accel_noise_factor * sheet.accel_noise_density);
}

}  // namespace
}  // namespace etalon
