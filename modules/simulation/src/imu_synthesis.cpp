#include "etalon/simulation/imu_synthesis.h"

#include <cmath>
#include <utility>

#include "etalon/core/errors.h"
#include "random.h"

namespace etalon {

using Eigen::Vector3d;

namespace {

void check(const ImuSynthesisOptions& options) {
  const auto finite_nonnegative = [](double x) { return std::isfinite(x) && x >= 0.0; };
  if (!std::isfinite(options.rate_hz) || options.rate_hz <= 0.0) {
    throw ConfigError("IMU synthesis needs a rate of more than 0 Hz");
  }
  const ImuNoiseDensities& n = options.noise;
  if (!finite_nonnegative(n.gyro_noise_density) || !finite_nonnegative(n.gyro_random_walk) ||
      !finite_nonnegative(n.accel_noise_density) || !finite_nonnegative(n.accel_random_walk)) {
    throw ConfigError("IMU synthesis needs noise densities that are finite and not negative");
  }
}

}  // namespace

ImuSynthesisOptions ImuSynthesisOptions::noiseFree(double rate_hz) {
  ImuSynthesisOptions options;
  options.rate_hz = rate_hz;
  options.white_noise = false;
  options.bias_walk = false;
  return options;
}

ImuBias randomImuBias(std::uint64_t seed) {
  Random random(seed, kBiasStream);
  ImuBias bias;
  bias.gyro = random.direction() * random.uniform(0.02, 0.08);
  bias.accel = random.direction() * random.uniform(0.07, 0.2);
  return bias;
}

SyntheticImu withImuErrors(std::vector<ImuSample> exact, const ImuSynthesisOptions& options) {
  check(options);
  const double sqrt_rate = std::sqrt(options.rate_hz);
  const double white = options.white_noise ? sqrt_rate : 0.0;
  const double walk = options.bias_walk ? 1.0 / sqrt_rate : 0.0;
  const ImuNoiseDensities& density = options.noise;
  Random random(options.seed, kImuNoiseStream);

  SyntheticImu imu;
  imu.samples = std::move(exact);
  ImuBias bias = options.initial_bias;
  for (ImuSample& sample : imu.samples) {
    if (options.recorded_bias) bias = options.recorded_bias(sample.t);
    // The same number of draws a sample, whatever is switched off: seeds stay comparable.
    const Vector3d n_g = random.normal3(), n_a = random.normal3();
    const Vector3d w_g = random.normal3(), w_a = random.normal3();
    sample.gyro = sample.gyro + bias.gyro + density.gyro_noise_density * white * n_g;
    sample.accel = sample.accel + bias.accel + density.accel_noise_density * white * n_a;
    imu.biases.push_back(bias);
    bias.gyro += density.gyro_random_walk * walk * w_g;
    bias.accel += density.accel_random_walk * walk * w_a;
  }
  return imu;
}

SyntheticImu synthesizeImu(const SimulatedTrajectory& trajectory, TimeNs from, TimeNs to,
                           const ImuSynthesisOptions& options) {
  check(options);
  const Vector3d g_W(0.0, 0.0, -options.gravity);
  std::vector<ImuSample> exact;
  for (std::int64_t k = 0;; ++k) {
    const TimeNs t = stampAtRate(from, options.rate_hz, k);
    if (t > to) break;
    const TrajectoryState state = trajectory.at(t);
    exact.push_back({t, state.omega_B, state.T_WB.R.transpose() * (state.a_W - g_W)});
  }
  return withImuErrors(std::move(exact), options);
}

}  // namespace etalon
