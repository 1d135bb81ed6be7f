#pragma once

#include "etalon/core/time.h"

namespace etalon {

struct KeyframeSelectorOptions {
  double rate_hz = 4.0;  ///< keyframes a second
};

/**
 * Chooses keyframes at a fixed rate: of the frames around a due instant the nearest. The instants
 * are counted from the first frame, so the rate does not drift; those that fall into a gap of the
 * camera are left out.
 */
class KeyframeSelector {
 public:
  explicit KeyframeSelector(const KeyframeSelectorOptions& options) : options_(options) {}

  /** Whether the frame at `t` is a keyframe; to be asked once a frame, in time order. */
  bool isKeyframe(TimeNs t);

 private:
  KeyframeSelectorOptions options_;
  bool started_ = false;
  TimeNs first_ = 0;
  TimeNs previous_ = 0;  ///< frame before
  TimeNs interval_ = 0;  ///< between the two frames before
  long long count_ = 0;  ///< keyframes so far
};

}  // namespace etalon
