#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/imu/imu_sample.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

struct ImuSynthesisOptions {
  double rate_hz = 200.0;
  double gravity = 9.81;    ///< magnitude, m/s^2
  ImuNoiseDensities noise;  ///< continuous time
  bool white_noise = true;
  bool bias_walk = true;
  ImuBias initial_bias;    ///< at the first sample
  std::uint64_t seed = 1;  ///< of white noise and walk
  /** Where set, the true biases are these and neither `initial_bias` nor the walk is used. */
  std::function<ImuBias(TimeNs)> recorded_bias;

  /** No noise, no walk, no biases. */
  static ImuSynthesisOptions noiseFree(double rate_hz = 200.0);
};

/** Biases as EuRoC's IMU has them: gyro 0.02 to 0.08 rad/s, accelerometer 0.07 to 0.2 m/s^2, in a
 * random direction. */
ImuBias randomImuBias(std::uint64_t seed);

struct SyntheticImu {
  std::vector<ImuSample> samples;
  std::vector<ImuBias> biases;  ///< the true ones, one a sample
};

/**
 * Exact samples at `options.rate_hz` with the errors of an IMU. A white density sigma_c becomes a
 * sample noise of sigma_c sqrt(rate_hz); a bias walks by a step of sigma_walk / sqrt(rate_hz) a
 * sample (the integral of its density over a sample's time).
 * @throws ConfigError for a rate or a density that cannot be
 */
SyntheticImu withImuErrors(std::vector<ImuSample> exact, const ImuSynthesisOptions& options);

/**
 * What an IMU in the body's origin measures, at from + k / rate_hz up to `to`:
 *   gyro = omega_B + b_g + n_g,  accel = R_WB^T (a_W - g_W) + b_a + n_a,
 * with the errors of withImuErrors().
 * @throws ConfigError for a rate or a density that cannot be
 */
SyntheticImu synthesizeImu(const SimulatedTrajectory& trajectory, TimeNs from, TimeNs to,
                           const ImuSynthesisOptions& options);

}  // namespace etalon
