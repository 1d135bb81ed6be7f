#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

/** A landmark seen in one stereo frame, without any image. */
struct SyntheticObservation {
  std::uint64_t id = 0;    ///< of the landmark; index into the landmarks
  Eigen::Vector2d left;    ///< px, in the raw (distorted) image
  Eigen::Vector2d right;   ///< px; meaningless without has_right
  bool has_right = false;  ///< seen by the right camera as well
  bool is_outlier = false;
};

struct SyntheticFrame {
  TimeNs t = 0;
  SE3 T_WB;                                        ///< true
  std::vector<SyntheticObservation> observations;  ///< ordered by id
};

struct TrackSynthesisOptions {
  double sigma_px = 0.5;  ///< of every pixel coordinate
  double outlier_ratio =
      0.0;  ///< share of observations that are moved by 5 to 40 px in a random direction
  double right_ratio = 1.0;  ///< share of landmarks in both views whose right observation is kept
  int max_tracks = 200;      ///< a frame; tracks that run go before new ones
  double border_px = 5.0;
  double min_depth_m = 0.3;
  double max_depth_m = 40.0;
  std::uint64_t seed = 1;
};

/**
 * Points on the walls, the floor and the ceiling of a box that encloses the trajectory with
 * `margin_m` to spare.
 * @return p_W, m, `count` of them
 */
std::vector<Eigen::Vector3d> scatterLandmarks(const SimulatedTrajectory& trajectory, int count,
                                              std::uint64_t seed, double margin_m = 2.5);

/**
 * What an ideal stereo tracker would report of `landmarks` (p_W, m) at `stamps`. Landmarks are
 * transparent: nothing hides anything. Seeded; noise-free with sigma_px = 0 and outlier_ratio = 0.
 */
std::vector<SyntheticFrame> simulateTracks(const SimulatedTrajectory& trajectory,
                                           const StereoInertialCalibration& calibration,
                                           const std::vector<TimeNs>& stamps,
                                           const std::vector<Eigen::Vector3d>& landmarks,
                                           const TrackSynthesisOptions& options = {});

}  // namespace etalon
