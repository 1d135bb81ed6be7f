#pragma once

#include <cstddef>

#include "etalon/benchmark/sequence_tracks.h"

namespace etalon {

/** How far stereo odometry over short windows is from two ground truths. */
struct VisionCheck {
  std::size_t windows = 0;                     ///< where odometry and both ground truths are there
  double recorded_m = 0.0, corrected_m = 0.0;  ///< medians of the windows' ATE
  std::size_t corrected_is_nearer = 0;         ///< in so many windows
};

/**
 * Stereo odometry alone, without IMU or ground truth but for the gyro that its search starts from,
 * over windows of 10 keyframes at 4 Hz (2.25 s) that begin every second. ATE is that of the
 * keyframes' positions, aligned in SE(3). No windows where the recording is too short.
 */
VisionCheck checkByVision(const SequenceTracks& tracks, const GroundTruth& recorded,
                          const GroundTruth& corrected);

}  // namespace etalon
