#pragma once

#include <algorithm>

#include "etalon/benchmark/sequence_tracks.h"

namespace etalon {

/** Drops the frames outside from_s to to_s after the first image. The first frame that is left
 * becomes the first image. */
inline void cutTracks(double from_s, double to_s, SequenceTracks* tracks) {
  std::vector<TrackedFrame>& frames = tracks->frames;
  const auto outside = [&](const TrackedFrame& frame) {
    const double after = secondsBetween(tracks->first_image, frame.t);
    return after < from_s || after > to_s;
  };
  frames.erase(std::remove_if(frames.begin(), frames.end(), outside), frames.end());
  if (!frames.empty()) tracks->first_image = frames.front().t;
}

}  // namespace etalon
