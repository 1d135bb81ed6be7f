#include "etalon/simulation/imu_synthesis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/simulation/integrated_trajectory.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

ProfileTrajectory flightOf(MotionProfile profile, double duration_s) {
  ProfileOptions options;
  options.profile = profile;
  options.duration_s = duration_s;
  return ProfileTrajectory(options);
}

TEST(ImuSynthesis, AtRestItMeasuresGravityAlone) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kStatic, 2.0);
  const SyntheticImu imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(),
                                         ImuSynthesisOptions::noiseFree());
  ASSERT_EQ(imu.samples.size(), 401u);
  for (const ImuSample& sample : imu.samples) {
    EXPECT_EQ(sample.gyro, Vector3d::Zero());
    EXPECT_LT((sample.accel - Vector3d(9.81, 0.0, 0.0)).norm(), 1e-12);  // EuRoC's x axis points up
  }
  EXPECT_EQ(imu.samples[1].t - imu.samples[0].t, 5'000'000);
}

TEST(ImuSynthesis, WhiteNoiseHasTheDensitysVariance) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kStatic, 200.0);
  ImuSynthesisOptions options;
  options.bias_walk = false;
  options.initial_bias.gyro = {0.01, -0.02, 0.03};
  options.initial_bias.accel = {0.1, 0.05, -0.08};
  const SyntheticImu imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(), options);
  const double n = static_cast<double>(imu.samples.size());
  Vector3d gyro = Vector3d::Zero(), accel = Vector3d::Zero();
  Eigen::Array3d gyro2 = Eigen::Array3d::Zero(), accel2 = Eigen::Array3d::Zero();
  const Vector3d rest(9.81, 0.0, 0.0);
  double lag_one = 0.0;
  Vector3d last = Vector3d::Zero();
  for (const ImuSample& sample : imu.samples) {
    const Vector3d g = sample.gyro - options.initial_bias.gyro;
    const Vector3d a = sample.accel - rest - options.initial_bias.accel;
    gyro += g / n;
    accel += a / n;
    gyro2 += g.array().square() / n;
    accel2 += a.array().square() / n;
    lag_one += g.dot(last);
    last = g;
  }
  const double sigma_g = options.noise.gyro_noise_density * std::sqrt(200.0);
  const double sigma_a = options.noise.accel_noise_density * std::sqrt(200.0);
  // 40,000 samples: a standard deviation is known to 1/sqrt(2n) = 0.35 %; five of those. Means to
  // sigma/sqrt(n).
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(gyro2[i]) / sigma_g, 1.0, 0.018);
    EXPECT_NEAR(std::sqrt(accel2[i]) / sigma_a, 1.0, 0.018);
    EXPECT_NEAR(gyro[i], 0.0, 5.0 * sigma_g / std::sqrt(n));
    EXPECT_NEAR(accel[i], 0.0, 5.0 * sigma_a / std::sqrt(n));
  }
  // Uncorrelated: the lag-one correlation of 3n pairs is 0 +- 1/sqrt(3n).
  EXPECT_NEAR(lag_one / (3.0 * n * sigma_g * sigma_g), 0.0, 5.0 / std::sqrt(3.0 * n));
}

TEST(ImuSynthesis, BiasesWalkAsTheirDensitySays) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kStatic, 4.0);
  constexpr int kRuns = 400;
  double gyro2 = 0.0, accel2 = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    ImuSynthesisOptions options;
    options.white_noise = false;
    options.seed = static_cast<std::uint64_t>(run);
    const SyntheticImu imu =
        synthesizeImu(trajectory, trajectory.start(), trajectory.end(), options);
    EXPECT_EQ(imu.biases.front().gyro, Vector3d::Zero());
    EXPECT_LT((imu.samples.back().gyro - imu.biases.back().gyro).norm(), 1e-15);
    gyro2 += imu.biases.back().gyro.squaredNorm() / (3.0 * kRuns);
    accel2 += imu.biases.back().accel.squaredNorm() / (3.0 * kRuns);
  }
  // After T = 4 s: sigma_walk sqrt(T). 1200 draws know it to 2 %; five of those.
  const ImuNoiseDensities noise;
  EXPECT_NEAR(std::sqrt(gyro2) / (noise.gyro_random_walk * 2.0), 1.0, 0.1);
  EXPECT_NEAR(std::sqrt(accel2) / (noise.accel_random_walk * 2.0), 1.0, 0.1);
}

TEST(ImuSynthesis, ReproducesAnIntegratedTrajectorysSamples) {
  const IntegratedTrajectory trajectory(flightOf(MotionProfile::kAggressive, 6.0), 200.0);
  const SyntheticImu imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(),
                                         ImuSynthesisOptions::noiseFree());
  ASSERT_EQ(imu.samples.size(), trajectory.samples().size());
  for (size_t k = 0; k < imu.samples.size(); ++k) {
    EXPECT_LT((imu.samples[k].gyro - trajectory.samples()[k].gyro).norm(), 1e-13);
    EXPECT_LT((imu.samples[k].accel - trajectory.samples()[k].accel).norm(), 1e-13);
  }
}

TEST(ImuSynthesis, SeededAndRealistic) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kGentle, 1.0);
  ImuSynthesisOptions options;
  const auto run = [&] {
    return synthesizeImu(trajectory, trajectory.start(), trajectory.end(), options).samples.back();
  };
  const ImuSample first = run();
  EXPECT_EQ(first.gyro, run().gyro);
  options.seed = 2;
  EXPECT_NE(first.gyro, run().gyro);
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const ImuBias bias = randomImuBias(seed);
    EXPECT_LE(bias.gyro.norm(), 0.08);
    EXPECT_GE(bias.accel.norm(), 0.07);
    EXPECT_LE(bias.accel.norm(), 0.2);
  }
}

TEST(ImuSynthesis, RecordedBiasesReplaceTheWalk) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kStatic, 1.0);
  ImuSynthesisOptions options;
  options.white_noise = false;
  options.recorded_bias = [&](TimeNs t) {
    ImuBias bias;
    bias.gyro.x() = secondsBetween(trajectory.start(), t);
    return bias;
  };
  const SyntheticImu imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(), options);
  EXPECT_NEAR(imu.samples[100].gyro.x(), 0.5, 1e-12);
}

TEST(ImuSynthesis, RefusesWhatCannotBe) {
  const ProfileTrajectory trajectory = flightOf(MotionProfile::kStatic, 1.0);
  ImuSynthesisOptions options;
  options.rate_hz = 0.0;
  EXPECT_THROW(synthesizeImu(trajectory, 0, 1, options), ConfigError);
  options.rate_hz = 200.0;
  options.noise.gyro_random_walk = -1.0;
  EXPECT_THROW(synthesizeImu(trajectory, 0, 1, options), ConfigError);
}

}  // namespace
}  // namespace etalon
