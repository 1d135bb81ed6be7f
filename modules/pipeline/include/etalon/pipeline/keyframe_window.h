#pragma once

#include <deque>

#include "etalon/frontend/keyframe_selector.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/**
 * The last `keyframes` keyframes, chosen at a fixed rate, and all frames between them: what an
 * initializer is asked about.
 */
class KeyframeWindow {
 public:
  KeyframeWindow(int keyframes, double rate_hz);

  /**
   * Adds a frame, later than those before.
   * @return whether it is a keyframe
   */
  bool add(const TrackedFrame& frame);
  /** Whether the frame at `t` will be a keyframe; to be asked once a frame, before add(). */
  bool isKeyframe(TimeNs t) { return is_keyframe_ = selector_.isKeyframe(t); }
  /** Begins anew: of the time before, or since, nothing is known. */
  void restart();
  /** Forgets the frames; the rate goes on. */
  void clear();

  /** Whether there are as many keyframes as wanted. */
  bool complete() const { return static_cast<int>(stamps_.size()) == keyframes_; }
  /** Stamps of the keyframes. */
  const std::deque<TimeNs>& stamps() const { return stamps_; }

  /**
   * The window as an initializer sees it, once it is complete and `imu` reaches over it.
   * @param noise makes the densities to use from the data sheet's and the window's samples
   */
  InitializationProblem problem(const StereoInertialCalibration& calibration,
                                const ImuNoiseOptions& noise, const WindowOptions& options,
                                const ImuBuffer& imu) const;

 private:
  int keyframes_;
  double rate_hz_;
  KeyframeSelector selector_;
  bool is_keyframe_ = false;  ///< the frame to be added
  std::deque<TrackedFrame> frames_;
  std::deque<TimeNs> stamps_;
};

}  // namespace etalon
