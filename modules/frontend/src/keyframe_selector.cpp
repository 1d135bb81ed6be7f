#include "etalon/frontend/keyframe_selector.h"

namespace etalon {

bool KeyframeSelector::isKeyframe(TimeNs t) {
  if (!started_) {
    started_ = true;
    first_ = previous_ = t;
    count_ = 1;
    return true;
  }
  const TimeNs frame_interval = t - previous_;
  previous_ = t;
  const TimeNs due = first_ + durationNs(static_cast<double>(count_) / options_.rate_hz);
  // The next frame will come one interval later: this one is the nearest if it is less than half of
  // that early.
  if (t + frame_interval / 2 < due) return false;
  while (first_ + durationNs(static_cast<double>(count_) / options_.rate_hz) <=
         t + frame_interval / 2)
    ++count_;
  return true;
}

}  // namespace etalon
