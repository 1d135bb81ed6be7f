#pragma once

// The old keyframes of a FixedLagOdometry, found again. Private to the module.

#include <memory>
#include <vector>

#include "recall.h"

namespace etalon::fixed_lag {

/**
 * Keeps the images of keyframes, and ties the newest state to old keyframes that show its landmarks:
 * by the joint covariance of both (Recall::recall()), and for a while after seconds without images
 * also by how they look (Recall::recognize()).
 */
class OldViews {
 public:
  /** @param matcher null: no view is kept, and nothing is found again */
  OldViews(const StereoInertialCalibration& calibration, const MapOptions& options, double sigma_px,
           std::shared_ptr<ViewMatcher> matcher);

  /** As they are used: not enabled without a matcher. */
  const MapOptions& options() const { return options_; }

  /** Forgets everything; the window has its first state. */
  void begin(Window* window);

  /** At a keyframe, after a first step of the solver. Fills in what was found and recognised. */
  void find(const TrackedFrame& frame, const WindowSolver& solver, Window* window,
            OdometryOutput* out);

  /** Images locate the newest frame. @param before when they did so last */
  void located(TimeNs before, TimeNs now);

  /** Makes one view a frame ready for recognition, from the newest on, while there is or soon will
   * be something to recognise. @param located_at when images located the platform last */
  void prepare(const Window& window, TimeNs located_at);

  /** Keeps the newest frame's images if it is a keyframe. */
  void keepNewest(Window* window);
  /** Drops the images of keyframes that have left the window. */
  void dropGone(const Window& window);

 private:
  /** Between these frames no image located the platform for a while, and no keyframe of before has
   * been found again yet. */
  struct Blind {
    TimeNs after = 0, until = 0;
  };
  void recognize(const TrackedFrame& frame, const WindowSolver& solver, Window* window,
                 OdometryOutput* out);

  Recall recall_;
  MapOptions options_;
  std::shared_ptr<ViewMatcher> matcher_;
  std::vector<Blind> blind_;  ///< in time order
};

}  // namespace etalon::fixed_lag
