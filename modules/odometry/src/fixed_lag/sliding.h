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
 * into the prior with all their observations in older states. A landmark that is still followed and
 * seen in the keyframe that leaves loses its observation there; where six keyframes or more see it,
 * it becomes two, of every second keyframe each: the half with that observation goes into the prior,
 * the other one is followed on. What is lost is that both are the same point. Otherwise a landmark
 * that is followed for longer than the window would lose nearly all observations, one by one.
 */
void slide(const SlidingOptions& options, Window* window);

/** The keyframe that the window can do without: one of which hardly any landmark is left, or that
 * stands where others do (Engel, Koltun and Cremers, Direct Sparse Odometry, PAMI 2018, III-D). */
size_t dispensableKeyframe(const Window& window);

}  // namespace etalon::fixed_lag
