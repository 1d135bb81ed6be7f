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

  /** Whether the frame at `t` is due as a keyframe; to be asked once a frame, in time order. */
  bool isKeyframe(TimeNs t) { return selector_.isKeyframe(t); }
  /** Adds a frame, later than those before. */
  void add(const TrackedFrame& frame, bool keyframe);
  /** Forgets keyframes before `t`, and the frames before the first one that is left. */
  void dropBefore(TimeNs t);
  /** Begins anew after a gap in the frames: forgets them, and when the next keyframe was due. */
  void restart();
  /** Forgets the frames; the rate goes on. */
  void clear();

  /** Whether there are as many keyframes as wanted. */
  bool complete() const { return static_cast<int>(stamps_.size()) == keyframes_; }
  /** Stamps of the keyframes. */
  const std::deque<TimeNs>& stamps() const { return stamps_; }
  /** All frames since the first keyframe, in time order. */
  const std::deque<TrackedFrame>& frames() const { return frames_; }

  /**
   * The window as an initializer sees it, once it has a keyframe. Its samples are those of `imu`
   * from the first keyframe to the last, as far as they reach; a negative time offset of `options`
   * takes as much before.
   * @param noise makes the densities to use from the data sheet's and the window's samples
   */
  InitializationProblem problem(const StereoInertialCalibration& calibration,
                                const ImuNoiseOptions& noise, const WindowOptions& options,
                                const ImuBuffer& imu) const;

 private:
  void dropFramesBeforeTheFirstKeyframe();

  int keyframes_;
  double rate_hz_;
  KeyframeSelector selector_;
  std::deque<TrackedFrame> frames_;
  std::deque<TimeNs> stamps_;
};

}  // namespace etalon
