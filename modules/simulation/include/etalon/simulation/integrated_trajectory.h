#pragma once

#include <vector>

#include "etalon/imu/imu_sample.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

/**
 * The motion that Preintegration makes of a smooth trajectory's IMU samples. Preintegration of
 * samples of a smooth motion is off by its discretisation, because it takes rate and acceleration
 * to be linear between samples. This trajectory takes the samples at `rate_hz` as they are and
 * defines its states by Preintegration of each step. Steps compose exactly, so preintegration
 * between any two sample stamps reproduces it to rounding. It stays near the smooth motion.
 *
 * Between sample stamps the measurements run linearly; splitting a step there changes the integral
 * by the discretisation of that step. Image stamps should therefore be sample stamps.
 */
class IntegratedTrajectory : public SimulatedTrajectory {
 public:
  /**
   * @param smooth    the motion to follow; only read during construction
   * @param rate_hz   of the samples, > 0 (ConfigError otherwise)
   * @param gravity   magnitude, m/s^2
   */
  IntegratedTrajectory(const SimulatedTrajectory& smooth, double rate_hz, double gravity = 9.81);

  /** At a sample stamp a_W and omega_B are those of the sample there. */
  TrajectoryState at(TimeNs t) const override;

  /** Noise-free, without biases. */
  const std::vector<ImuSample>& samples() const { return samples_; }

 private:
  TrajectoryState step(const TrajectoryState& from, const ImuSample& a, const ImuSample& b) const;

  Eigen::Vector3d g_W_;
  std::vector<ImuSample> samples_;
  std::vector<TrajectoryState> states_;  // at the samples
};

}  // namespace etalon
