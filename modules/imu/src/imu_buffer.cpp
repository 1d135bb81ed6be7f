#include "etalon/imu/imu_buffer.h"

#include <algorithm>
#include <limits>

#include "etalon/core/errors.h"

namespace etalon {
static ImuSample lerp(const ImuSample& a, const ImuSample& b, TimeNs t) {
  const double u = secondsBetween(a.t, t) / secondsBetween(a.t, b.t);
  return {t, a.gyro + u * (b.gyro - a.gyro), a.accel + u * (b.accel - a.accel)};
}
static bool earlier(const ImuSample& s, TimeNs t) { return s.t < t; }
ImuBuffer::ImuBuffer(std::vector<ImuSample> samples) : samples_(std::move(samples)) {}
void ImuBuffer::add(const ImuSample& sample) {
  if (!samples_.empty() && sample.t <= samples_.back().t)
    throw DataError("", 0, "IMU stamps must increase");
  samples_.push_back(sample);
}
void ImuBuffer::dropBefore(TimeNs t) {
  auto it = std::upper_bound(samples_.begin(), samples_.end(), t,
                             [](TimeNs v, const ImuSample& s) { return v < s.t; });
  if (it != samples_.begin()) samples_.erase(samples_.begin(), it - 1);
}
bool ImuBuffer::covers(TimeNs t0, TimeNs t1) const {
  return !samples_.empty() && samples_.front().t <= t0 && t1 <= samples_.back().t;
}
std::vector<ImuSample> ImuBuffer::between(TimeNs t0, TimeNs t1) const {
  std::vector<ImuSample> out;
  if (t1 <= t0 || !covers(t0, t1)) return out;
  auto a = std::lower_bound(samples_.begin(), samples_.end(), t0, earlier);
  auto b = std::lower_bound(samples_.begin(), samples_.end(), t1, earlier);
  if (a->t != t0) out.push_back(lerp(*(a - 1), *a, t0));
  out.insert(out.end(), a, b);
  out.push_back(b->t == t1 ? *b : lerp(*(b - 1), *b, t1));
  return out;
}
double ImuBuffer::longestGap(TimeNs t0, TimeNs t1) const {
  const auto s = between(t0, t1);
  if (s.size() < 2) return std::numeric_limits<double>::infinity();
  double gap = 0;
  for (size_t i = 1; i < s.size(); ++i) gap = std::max(gap, secondsBetween(s[i - 1].t, s[i].t));
  return gap;
}
}  // namespace etalon
