#pragma once

// The newest frame's landmarks in the keyframes that were retained. Private to the module.

#include "etalon/map/map_options.h"
#include "etalon/map/view_geometry.h"
#include "etalon/map/view_matcher.h"
#include "etalon/odometry/odometry.h"
#include "window_solver.h"

namespace etalon::fixed_lag {

/**
 * Looks for the landmarks of the newest state in the retained keyframes that see the same scene,
 * and gives them their observations there. A landmark that was found stays tied to the old keyframe
 * for as long as it is followed, and goes into the prior with that observation. The n-th landmark
 * that is found at the same point of a view counts for 1/n: they share that image's error.
 */
class Recall {
 public:
  Recall(const StereoInertialCalibration& calibration, const MapOptions& options, double sigma_px)
      : calibration_(&calibration), options_(options), sigma_px_(sigma_px) {}

  /** @return what was found */
  std::vector<RecalledObservation> recall(const TrackedFrame& frame, ViewMatcher* matcher,
                                          const WindowSolver& solver, Window* window) const;

 private:
  struct Candidate;
  std::vector<SeenLandmark> seenLandmarks(const TrackedFrame& frame, const Window& window) const;
  void search(const Candidate& candidate, const std::vector<SeenLandmark>& seen,
              ViewMatcher* matcher, Window* window,
              std::vector<RecalledObservation>* recalled) const;

  const StereoInertialCalibration* calibration_;
  MapOptions options_;
  double sigma_px_;
};

}  // namespace etalon::fixed_lag
