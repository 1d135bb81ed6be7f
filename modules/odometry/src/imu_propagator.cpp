#include "etalon/odometry/imu_propagator.h"

#include <algorithm>

namespace etalon {

void ImuPropagator::correct(TimeNs t, const NavState& state) {
  state_ = ahead_ = state;
  t_ = ahead_t_ = t;
  imu_.dropBefore(t);
  carryOn();
}

void ImuPropagator::clockJumped() {
  imu_ = ImuBuffer();
  ahead_.reset();
}

void ImuPropagator::add(const ImuSample& sample) {
  if (!imu_.empty() && secondsBetween(imu_.samples().back().t, sample.t) > max_gap_s_)
    clockJumped();
  imu_.add(sample);
  carryOn();
  if (imu_.samples().size() <= kMostSamples) return;
  if (const auto state = at(sample.t)) correct(sample.t, *state);
  imu_.dropBefore(sample.t);
}

TimeNs ImuPropagator::end() const {
  return imu_.empty() ? t_ : std::max(t_, imu_.samples().back().t);
}

std::optional<NavState> ImuPropagator::at(TimeNs t) const {
  if (!state_ || t < t_) return std::nullopt;
  if (ahead_ && t >= ahead_t_) return integrated(*ahead_, ahead_t_, t);
  return integrated(*state_, t_, t);
}

std::optional<NavState> ImuPropagator::integrated(const NavState& from, TimeNs t0,
                                                  TimeNs t1) const {
  if (t1 == t0) return from;
  if (!imu_.covers(t0, t1)) return std::nullopt;
  return Preintegration(imu_.between(t0, t1), from.bias, noise_).predict(from, g_W_);
}

void ImuPropagator::carryOn() {
  if (!ahead_ || imu_.empty() || imu_.samples().back().t <= ahead_t_) return;
  ahead_ = integrated(*ahead_, ahead_t_, imu_.samples().back().t);
  ahead_t_ = imu_.samples().back().t;
}

}  // namespace etalon
