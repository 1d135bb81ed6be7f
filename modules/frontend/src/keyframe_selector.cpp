#include "etalon/frontend/keyframe_selector.h"

#include <algorithm>

namespace etalon {

void KeyframeSelectorOptions::declare(ParameterSet& parameters) {
  parameters.add("rate_hz", &rate_hz, {0.1, 1000.0}, "Keyframes per second.");
}

bool KeyframeSelector::isKeyframe(TimeNs t) {
  const TimeNs period = durationNs(1.0 / options_.rate_hz);
  if (!started_) {
    started_ = true;
    first_ = previous_ = t;
    interval_ = period;
    count_ = 1;
    return true;
  }
  // When the next frame will come: a gap before this one says nothing about it.
  const TimeNs interval = t - previous_;
  const TimeNs expected = std::min({interval, interval_, period});
  previous_ = t;
  interval_ = interval;
  const auto due = [this] {
    return first_ + durationNs(static_cast<double>(count_) / options_.rate_hz);
  };
  // This frame is the nearest to an instant if it is less than half an interval early.
  if (t + expected / 2 < due()) return false;
  while (due() <= t + expected / 2) ++count_;
  return true;
}

}  // namespace etalon
