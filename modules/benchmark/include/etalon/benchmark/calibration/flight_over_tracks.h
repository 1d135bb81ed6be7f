#pragma once

#include <optional>
#include <vector>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/odometry/odometry.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/pipeline/pipeline_options.h"

namespace etalon {

/** Where an odometry begins in a recording: a frame's index, and the state there. */
struct TracksStart {
  size_t frame = 0;
  TimeNs accepted = 0;  ///< stamp of the window's last keyframe
  OdometryStart start;
};

/** The first window of the recording, four tried a second, that the initializer solves and that is
 * accepted: its first keyframe. Nothing if there is none. */
std::optional<TracksStart> firstStart(const SequenceTracks& tracks, const PipelineOptions& options,
                                      const Initializer& initializer);

/**
 * A flight of the fixed-lag odometry over a recording's tracks, from the first start that is
 * accepted on: as the
 * pipeline flies it, but without a map, for which it has no images, and with one start only. Empty
 * without a start.
 */
std::vector<FrameEstimate> flyOverTracks(const SequenceTracks& tracks,
                                         const PipelineOptions& options,
                                         const Initializer& initializer);

}  // namespace etalon
