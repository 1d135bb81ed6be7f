#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

struct TrackSynthesisOptions {
  double sigma_px = 0.5;  ///< of every pixel coordinate
  /** Share of the pixels, left and right alike, that are moved by 5 to 50 px in a random direction.
   */
  double outlier_ratio = 0.0;
  double right_ratio = 1.0;  ///< share of landmarks in both views whose right observation is kept
  int max_tracks = 200;      ///< a frame; tracks that run go before new ones
  double border_px = 5.0;
  double min_depth_m = 0.3;
  double max_depth_m = 40.0;
  std::uint64_t seed = 1;
};

/**
 * Points on the walls, the floor and the ceiling of a box that encloses `positions` (p_W, m) with
 * `margin_m` to spare.
 * @return p_W, m, `count` of them
 */
std::vector<Eigen::Vector3d> scatterLandmarks(const std::vector<Eigen::Vector3d>& positions,
                                              int count, std::uint64_t seed, double margin_m = 2.5);

/** The same around a flight. */
std::vector<Eigen::Vector3d> scatterLandmarks(const SimulatedTrajectory& trajectory, int count,
                                              std::uint64_t seed, double margin_m = 2.5);

/**
 * What an ideal stereo tracker would report of `landmarks` (p_W, m; their index is the id) at
 * `poses`. Landmarks are transparent: nothing hides anything. Seeded; noise-free with sigma_px = 0
 * and outlier_ratio = 0.
 */
std::vector<TrackedFrame> simulateTracks(const Trajectory& poses,
                                         const StereoInertialCalibration& calibration,
                                         const std::vector<Eigen::Vector3d>& landmarks,
                                         const TrackSynthesisOptions& options = {});

}  // namespace etalon
