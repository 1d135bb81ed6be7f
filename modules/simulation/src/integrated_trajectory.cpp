#include "etalon/simulation/integrated_trajectory.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

IntegratedTrajectory::IntegratedTrajectory(const SimulatedTrajectory& smooth, double rate_hz,
                                           double gravity)
    : g_W_(0.0, 0.0, -gravity) {
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz)) {
    throw ConfigError("an integrated trajectory needs an IMU rate of more than 0 Hz");
  }
  start_ = smooth.start();
  for (std::int64_t k = 0;; ++k) {
    const TimeNs t = stampAtRate(start_, rate_hz, k);
    if (t > smooth.end()) break;
    const TrajectoryState ideal = smooth.at(t);
    ImuSample sample;
    sample.t = t;
    sample.gyro = ideal.omega_B;
    sample.accel = ideal.T_WB.R.transpose() * (ideal.a_W - g_W_);
    samples_.push_back(sample);
    states_.push_back(states_.empty()
                          ? ideal
                          : step(states_.back(), samples_[samples_.size() - 2], samples_.back()));
  }
  end_ = samples_.back().t;
}

TrajectoryState IntegratedTrajectory::step(const TrajectoryState& from, const ImuSample& a,
                                           const ImuSample& b) const {
  const NavState end = Preintegration({a, b}, ImuBias(), ImuNoiseDensities())
                           .predict({from.T_WB, from.v_WB, ImuBias()}, g_W_);
  return {b.t, end.T_WB, end.v_WB, end.T_WB.R * b.accel + g_W_, b.gyro};
}

TrajectoryState IntegratedTrajectory::at(TimeNs t) const {
  const TimeNs inside = std::clamp(t, start_, end_);
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), inside,
                                      [](TimeNs a, const ImuSample& b) { return a < b.t; });
  const size_t k = after - samples_.begin() - 1;
  TrajectoryState state = states_[k];
  if (samples_[k].t != inside) {
    const ImuSample &a = samples_[k], &b = samples_[k + 1];
    const double w = secondsBetween(a.t, inside) / secondsBetween(a.t, b.t);
    state = step(states_[k], a,
                 {inside, a.gyro + w * (b.gyro - a.gyro), a.accel + w * (b.accel - a.accel)});
  }
  state.t = t;
  return state;
}

}  // namespace etalon
