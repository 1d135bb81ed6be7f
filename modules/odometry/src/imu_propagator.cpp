#include "etalon/odometry/imu_propagator.h"

#include <algorithm>

namespace etalon {

void ImuPropagator::correct(TimeNs t, const NavState& state) {
  state_ = state;
  t_ = t;
  imu_.dropBefore(t);
}

void ImuPropagator::add(const ImuSample& sample) {
  if (!imu_.empty() && secondsBetween(imu_.samples().back().t, sample.t) > max_gap_s_)
    imu_ = ImuBuffer();
  imu_.add(sample);
  if (imu_.samples().size() <= kMostSamples) return;
  if (const auto state = at(sample.t)) correct(sample.t, *state);
  imu_.dropBefore(sample.t);
}

TimeNs ImuPropagator::end() const {
  return imu_.empty() ? t_ : std::max(t_, imu_.samples().back().t);
}

std::optional<NavState> ImuPropagator::at(TimeNs t) const {
  if (!state_ || t < t_) return std::nullopt;
  if (t == t_) return state_;
  if (!imu_.covers(t_, t)) return std::nullopt;
  return Preintegration(imu_.between(t_, t), state_->bias, noise_).predict(*state_, g_W_);
}

}  // namespace etalon
