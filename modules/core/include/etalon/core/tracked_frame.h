#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "etalon/core/time.h"

namespace etalon {

using LandmarkId = std::int64_t;

/** Standard deviation of a tracked pixel coordinate unless a configuration says otherwise, px
 * (docs/noise.md). */
constexpr double kTrackSigmaPx = 0.29;

/** One landmark seen in one stereo frame: raw (distorted) pixels, the right one where it was found.
 */
struct Observation {
  LandmarkId id = -1;
  Eigen::Vector2d left = Eigen::Vector2d::Zero();   ///< px
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< px, meaningless unless has_right
  bool has_right = false;
};

/** A landmark that only the right image of a stereo frame shows. */
struct RightObservation {
  LandmarkId id = -1;
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< px, raw
};

/** All landmarks seen in a stereo frame, in increasing order of id. */
struct TrackedFrame {
  TimeNs t = 0;
  std::vector<Observation> observations;
  /** Landmarks outside of `observations`; they occur where the left image is or was unusable. */
  std::vector<RightObservation> right_only;
};

}  // namespace etalon
