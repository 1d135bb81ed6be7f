#include "etalon/frontend/keyframe_selector.h"

#include <algorithm>

namespace etalon {

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
  const TimeNs reached = t + expected / 2;
  if (reached < due()) return false;
  // After a jump of the stamps there are many; division finds them but for rounding.
  const double passed = secondsBetween(first_, reached) * options_.rate_hz;
  count_ = std::max(count_, static_cast<long long>(passed) - 1);
  while (due() <= reached) ++count_;
  return true;
}

}  // namespace etalon
