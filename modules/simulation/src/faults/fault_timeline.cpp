#include "fault_timeline.h"

#include <algorithm>

#include "fault_list.h"
#include "imu_faults.h"

namespace etalon {

namespace {

constexpr TimeNs kLeastStep = 1'000'000;  // between two images, if jitter would swap them

/** How late the stamp of pair number `index` is, against the IMU. */
TimeNs lateness(const std::vector<Fault>& faults, double s, size_t index, std::uint64_t seed) {
  TimeNs late = 0;
  forEachFaultAt<faults::Delay>(
      faults, s, [&](const faults::Delay& fault, size_t) { late += durationNs(1e-3 * fault.ms); });
  forEachFaultAt<faults::Jitter>(faults, s, [&](const faults::Jitter& fault, size_t i) {
    const double sigmas = std::clamp(faultRandom(seed, i, index).normal(), -3.0, 3.0);
    late += durationNs(1e-3 * fault.ms * sigmas);
  });
  return late;
}

}  // namespace

FaultTimeline::FaultTimeline(const std::vector<Fault>& faults,
                             const std::vector<TimeNs>& image_stamps, TimeNs zero,
                             std::uint64_t seed)
    : zero_(zero), before_(image_stamps), stamps_(image_stamps.size()) {
  forEachFault<faults::ClockJump>(faults, [&](const faults::ClockJump& fault, size_t) {
    jumps_.push_back({fault.from_s, durationNs(fault.by_s)});
  });
  for (size_t i = 0; i < before_.size(); ++i) {
    if (!keeps(faults, i, seed)) continue;
    const TimeNs plain = jumped(before_[i]);
    TimeNs stamp = plain + lateness(faults, seconds(before_[i]), i, seed);
    if (!kept_.empty()) stamp = std::max(stamp, kept_.back() + kLeastStep);
    most_early_ = std::max(most_early_, plain - stamp);
    stamps_[i] = stamp;
    kept_.push_back(stamp);
  }
}

bool FaultTimeline::keeps(const std::vector<Fault>& faults, size_t index,
                          std::uint64_t seed) const {
  const double s = seconds(before_[index]);
  bool kept = !anyFaultAt<faults::Dropped>(faults, s);
  forEachFaultAt<faults::Lost>(faults, s, [&](const faults::Lost& fault, size_t i) {
    if (faultRandom(seed, i, index).uniform() < 1e-2 * fault.percent) kept = false;
  });
  forEachFaultAt<faults::Every>(faults, s, [&](const faults::Every& fault, size_t) {
    if (index % static_cast<size_t>(fault.n) != 0) kept = false;
  });
  return kept;
}

TimeNs FaultTimeline::jumped(TimeNs t) const {
  TimeNs result = t;
  for (const Jump& jump : jumps_)
    if (seconds(t) >= jump.from_s) result += jump.by;
  return result;
}

std::optional<size_t> FaultTimeline::indexOf(TimeNs t) const {
  const auto found = std::lower_bound(before_.begin(), before_.end(), t);
  if (found == before_.end() || *found != t) return std::nullopt;
  return static_cast<size_t>(found - before_.begin());
}

GroundTruth faultyTruth(GroundTruth truth, const std::vector<Fault>& faults,
                        const FaultTimeline& timeline, std::uint64_t seed) {
  for (StampedState& state : truth.states) {
    if (truth.has_biases) {
      const ImuBias added = addedBias(faults, timeline.seconds(state.t), seed);
      state.bias.gyro += added.gyro;
      state.bias.accel += added.accel;
    }
    state.t = timeline.jumped(state.t);
  }
  return truth;
}

}  // namespace etalon
