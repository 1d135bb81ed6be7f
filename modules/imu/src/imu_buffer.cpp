#include "etalon/imu/imu_buffer.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using Iterator = std::vector<ImuSample>::const_iterator;

void requireLater(TimeNs previous, TimeNs next) {
  if (next > previous) return;
  throw DataError("", 0,
                  "IMU samples out of order: stamp " + std::to_string(next) + " ns follows " +
                      std::to_string(previous) + " ns; expected strictly increasing stamps");
}

/** The first sample later than `t`. */
Iterator firstAfter(const std::vector<ImuSample>& samples, TimeNs t) {
  return std::upper_bound(samples.begin(), samples.end(), t,
                          [](TimeNs value, const ImuSample& s) { return value < s.t; });
}

/** The first sample at or later than `t`. */
Iterator firstNotBefore(const std::vector<ImuSample>& samples, TimeNs t) {
  return std::lower_bound(samples.begin(), samples.end(), t,
                          [](const ImuSample& s, TimeNs value) { return s.t < value; });
}

/** The measurement at `t`, linear between two samples a.t < t < b.t. */
ImuSample interpolate(const ImuSample& a, const ImuSample& b, TimeNs t) {
  const double u = secondsBetween(a.t, t) / secondsBetween(a.t, b.t);
  return {t, a.gyro + u * (b.gyro - a.gyro), a.accel + u * (b.accel - a.accel),
          static_cast<std::uint8_t>(a.saturated | b.saturated)};
}

}  // namespace

ImuBuffer::ImuBuffer(std::vector<ImuSample> samples) : samples_(std::move(samples)) {
  for (size_t k = 1; k < samples_.size(); ++k) requireLater(samples_[k - 1].t, samples_[k].t);
}

void ImuBuffer::add(const ImuSample& sample) {
  if (!samples_.empty()) requireLater(samples_.back().t, sample.t);
  samples_.push_back(sample);
}

void ImuBuffer::dropBefore(TimeNs t) {
  const auto after = firstAfter(samples_, t);
  if (after == samples_.begin()) return;
  samples_.erase(samples_.begin(), after - 1);
}

bool ImuBuffer::covers(TimeNs t0, TimeNs t1) const {
  return !samples_.empty() && t0 <= t1 && samples_.front().t <= t0 && t1 <= samples_.back().t;
}

std::vector<ImuSample> ImuBuffer::between(TimeNs t0, TimeNs t1) const {
  if (t1 <= t0 || !covers(t0, t1)) return {};
  const auto inner_begin = firstAfter(samples_, t0);
  const auto inner_end = firstNotBefore(samples_, t1);  // t1 is covered: never past the end
  std::vector<ImuSample> cut;
  cut.reserve(inner_end - inner_begin + 2);
  const ImuSample& before = *(inner_begin - 1);  // t0 is covered: there is one at or before it
  cut.push_back(before.t == t0 ? before : interpolate(before, *inner_begin, t0));
  cut.insert(cut.end(), inner_begin, inner_end);
  cut.push_back(inner_end->t == t1 ? *inner_end : interpolate(*(inner_end - 1), *inner_end, t1));
  return cut;
}

double ImuBuffer::longestGap(TimeNs t0, TimeNs t1) const {
  if (t1 <= t0 || !covers(t0, t1)) return std::numeric_limits<double>::infinity();
  TimeNs longest = 0;
  TimeNs previous = t0;
  const auto end = firstNotBefore(samples_, t1);
  for (auto sample = firstAfter(samples_, t0); sample != end; ++sample) {
    longest = std::max(longest, sample->t - previous);
    previous = sample->t;
  }
  return secondsBetween(0, std::max(longest, t1 - previous));
}

}  // namespace etalon
