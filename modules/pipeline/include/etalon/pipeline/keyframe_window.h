#pragma once

#include <deque>
#include <optional>

#include "etalon/frontend/keyframe_selector.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/**
 * The last `keyframes` keyframes, chosen at a fixed rate, and all frames between them: what an
 * initializer is asked about. Where the next attempt should not wait for the rate, takeSooner() puts
 * one keyframe more between these; it does not count, so the window's time stays.
 */
class KeyframeWindow {
 public:
  KeyframeWindow(int keyframes, double rate_hz);

  /** Whether the frame at `t` is due as a keyframe; to be asked once a frame, in time order. */
  bool isKeyframe(TimeNs t);
  /** The frame nearest to `after_s` behind the last keyframe is a keyframe, too, unless one of the
   * rate comes first. Not behind an additional one: between two keyframes of the rate there is one
   * at most. */
  void takeSooner(double after_s);
  /** Adds a frame, later than those before. */
  void add(const TrackedFrame& frame, bool keyframe);
  /** Forgets keyframes before `t`, and the frames before the first one that is left. */
  void dropBefore(TimeNs t);
  /** Begins anew after a gap in the frames: forgets them, and when the next keyframe was due. */
  void restart();
  /** Forgets the frames; the rate goes on. */
  void clear();

  /** How many of the keyframes are those of the rate. */
  int regularKeyframes() const { return static_cast<int>(stamps_.size() - additional_.size()); }
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
  void dropFirstKeyframe();
  void dropFramesBeforeTheFirstKeyframe();

  int keyframes_;
  double rate_hz_;
  KeyframeSelector selector_;
  std::deque<TrackedFrame> frames_;
  std::deque<TimeNs> stamps_;
  std::deque<TimeNs> additional_;         ///< of stamps_, those between the keyframes of the rate
  std::optional<TimeNs> additional_due_;  ///< the first frame from here on is one
  TimeNs last_frame_ = 0;                 ///< that isKeyframe() was asked about
  bool regular_ = true;                   ///< the last keyframe of isKeyframe() is one of the rate
};

}  // namespace etalon
