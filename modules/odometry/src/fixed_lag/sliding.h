#pragma once

// What leaves a window, and what stays of it. Private to the module.

#include "etalon/map/map_options.h"
#include "visual_terms.h"

namespace etalon::fixed_lag {

struct SlidingOptions {
  int recent_frames = 3;
  int keyframes = 7;
  MapOptions map;
};

/**
 * Keeps the window at its size: while there are more full states than `recent_frames`, the oldest
 * becomes a keyframe with its pose alone, or leaves with its pixels if it is none; while there are
 * more keyframes than `keyframes`, one leaves. At a keyframe, landmarks that are seen no more go
 * into the prior with all their observations in older states. A landmark that is still followed
 * becomes two, if the keyframe that leaves is in the older half of those that see it: that half goes
 * into the prior, the newer one is followed on. What is lost is that both are the same point. To drop
 * the one observation in the leaving keyframe, as is done where it is in the newer half, would in the
 * end drop nearly all of a landmark that is followed for longer than the window.
 */
void slide(const SlidingOptions& options, Window* window);

/** The keyframe that the window can do without: one of which hardly any landmark is left, or that
 * stands where others do (Engel, Koltun and Cremers, Direct Sparse Odometry, PAMI 2018, III-D). */
size_t dispensableKeyframe(const Window& window);

}  // namespace etalon::fixed_lag
