#include "bridged_imu.h"

#include <algorithm>
#include <cmath>

#include "etalon/imu/imu_limits.h"

namespace etalon {

namespace {

bool reach(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1) {
  return imu.size() >= 2 && imu.front().t == t0 && imu.back().t == t1;
}

}  // namespace

double longestGap(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1) {
  if (!reach(imu, t0, t1)) return secondsBetween(t0, t1);
  double gap = 0.0;
  for (size_t k = 1; k < imu.size(); ++k)
    gap = std::max(gap, secondsBetween(imu[k - 1].t, imu[k].t));
  return gap;
}

bool isComplete(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1, double rate_hz) {
  return reach(imu, t0, t1) && longestGap(imu, t0, t1) <= longestImuStep(rate_hz);
}

Preintegration bridgedImu(const NavState& from, TimeNs t0, TimeNs t1, std::vector<ImuSample> imu,
                          ImuNoiseDensities noise, const Eigen::Vector3d& g_W) {
  const double gap = longestGap(imu, t0, t1);
  if (!reach(imu, t0, t1)) {
    ImuSample still;
    still.gyro = from.bias.gyro;
    still.accel = from.bias.accel - from.T_WB.R.transpose() * g_W;
    imu.assign(2, still);
    imu[0].t = t0;
    imu[1].t = t1;
  }
  noise.gyro_noise_density = std::hypot(noise.gyro_noise_density, 0.5 * std::sqrt(gap));
  noise.accel_noise_density = std::hypot(noise.accel_noise_density, 2.0 * std::sqrt(gap));
  return Preintegration(std::move(imu), from.bias, noise);
}

}  // namespace etalon
