#pragma once

// The newest frame's landmarks in the keyframes that were retained. Private to the module.

#include "etalon/map/map_options.h"
#include "etalon/map/view_search.h"
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

  /**
   * Recognises one of the retained keyframes from before a while without images by how it looks,
   * another one with every call: the joint covariance says too little of where to look. The states
   * since the first such while after that keyframe turn about the vertical and move to where it has
   * the newest one, so that what was found there is believed when the window is solved next.
   * @param after last frames before a while without images, in time order, at least one
   * @param recalled what was found
   */
  std::optional<Recognition> recognize(const TrackedFrame& frame, const std::vector<TimeNs>& after,
                                       ViewMatcher* matcher, const WindowSolver& solver,
                                       Window* window,
                                       std::vector<RecalledObservation>* recalled) const;

 private:
  struct Candidate;
  std::vector<SeenLandmark> seenLandmarks(const TrackedFrame& frame, const Window& window) const;
  std::vector<Candidate> candidatesFor(const std::vector<SeenLandmark>& seen,
                                       const Window& window) const;
  WindowState* toRecognize(TimeNs after, const std::vector<SeenLandmark>& seen,
                           Window* window) const;
  ViewSearch searchWith(ViewMatcher* matcher, const Window& window) const;
  void observe(size_t view, const ViewFindings& findings, const std::vector<SeenLandmark>& seen,
               Window* window, std::vector<RecalledObservation>* recalled) const;

  const StereoInertialCalibration* calibration_;
  MapOptions options_;
  double sigma_px_;
};

}  // namespace etalon::fixed_lag
