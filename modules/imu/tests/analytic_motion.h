#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

/**
 * A smooth flight known in closed form: rotation vector and position are sums of sines, so that
 * rates, velocities and specific forces are exact. `intensity` scales the rotation.
 */
struct AnalyticMotion {
  double intensity = 1.0;
  Eigen::Vector3d g_W = Eigen::Vector3d(0, 0, -9.81);  // m/s^2

  static Eigen::Vector3d wave(const Eigen::Vector3d& amplitude, const Eigen::Vector3d& rate_rps,
                              double t, int derivative) {
    Eigen::Vector3d value;
    for (int i = 0; i < 3; ++i)
      value[i] = amplitude[i] * std::pow(rate_rps[i], derivative) *
                 std::sin(rate_rps[i] * t + 0.4 * i + derivative * M_PI_2);
    return value;
  }

  Eigen::Vector3d phi(double t, int derivative = 0) const {
    return wave(intensity * Eigen::Vector3d(0.6, -0.5, 0.9), {2.1, 1.7, 1.3}, t, derivative);
  }
  Eigen::Vector3d position(double t, int derivative = 0) const {
    return wave({0.8, 1.1, -0.5}, {1.9, 1.4, 2.3}, t, derivative);
  }
  Eigen::Matrix3d R_WB(double t) const { return expSO3(phi(t)); }

  ImuSample sample(TimeNs stamp) const {
    const double t = secondsBetween(0, stamp);
    const Eigen::Vector3d gyro = rightJacobianSO3(phi(t)) * phi(t, 1);
    return {stamp, gyro, R_WB(t).transpose() * (position(t, 2) - g_W)};
  }

  std::vector<ImuSample> samples(const std::vector<TimeNs>& stamps) const {
    std::vector<ImuSample> all;
    for (TimeNs stamp : stamps) all.push_back(sample(stamp));
    return all;
  }

  Preintegration::Deltas deltas(TimeNs start, TimeNs end) const {
    const double t0 = secondsBetween(0, start), t1 = secondsBetween(0, end), dt = t1 - t0;
    const Eigen::Matrix3d R_BW = R_WB(t0).transpose();
    return {R_BW * R_WB(t1), R_BW * (position(t1, 1) - position(t0, 1) - g_W * dt),
            R_BW * (position(t1) - position(t0) - position(t0, 1) * dt - 0.5 * g_W * dt * dt)};
  }
};

/** Stamps start, start + step, ... up to and including start + count step. */
inline std::vector<TimeNs> evenStamps(TimeNs start, TimeNs step, int count) {
  std::vector<TimeNs> stamps;
  for (int k = 0; k <= count; ++k) stamps.push_back(start + k * step);
  return stamps;
}

/** Steps between 0.3 and 1.7 times `step`, the first and the last shorter still, as cut intervals
 * have them. */
inline std::vector<TimeNs> unevenStamps(TimeNs start, TimeNs step, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> factor(0.3, 1.7);
  std::vector<TimeNs> stamps{start};
  for (int k = 0; k < count; ++k) {
    const double scale = k == 0 || k + 1 == count ? 0.1 : factor(random);
    stamps.push_back(stamps.back() + static_cast<TimeNs>(scale * static_cast<double>(step)));
  }
  return stamps;
}

inline Eigen::Vector3d gaussian(std::mt19937* random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(*random), y = normal(*random), z = normal(*random);
  return {x, y, z};
}

}  // namespace etalon
