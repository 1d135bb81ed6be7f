#pragma once

// Private to the module.

#include <algorithm>
#include <cmath>
#include <vector>

#include "etalon/core/time.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/** The time that an odometry is given: the stamps, less what their clock jumped since it started. */
class OdometryClock {
 public:
  void restart() { shift_ = 0; }
  void jump(TimeNs from, TimeNs to) {
    if (!hasJumped()) from_ = from;
    to_ = std::max(from_, to);
    jumped_s_ += std::abs(secondsBetween(from, to));
  }
  /** The next frame. The true time across a jump is unknown: the step of the frames before is
   * taken. */
  void frame(TimeNs before, TimeNs t) {
    if (hasJumped() && isAfterJump(t))
      shift_ += t - before - std::max(step_, kShortestStep);
    else
      step_ = t - before;
  }
  /** What jumped is behind the last frame, at t, but for a frame that was taken before the jump and
   * came after it. @param imu stamp of the last sample */
  void frameDone(TimeNs t, TimeNs imu) {
    if (isAfterJump(t) || secondsBetween(to_, imu) > kLateS) jumped_s_ = 0.0;
  }

  /** Whether it has since the last frame, and by how much, s. */
  bool hasJumped() const { return jumped_s_ > 0.0; }
  double jumpedSeconds() const { return jumped_s_; }
  /** Where the IMU goes on after the jump, if hasJumped(), or where it catches up. */
  TimeNs jumpedTo() const { return to_; }

  TimeNs at(TimeNs stamp) const { return stamp - shift_; }
  std::vector<ImuSample> at(std::vector<ImuSample> samples) const {
    for (ImuSample& sample : samples) sample.t = at(sample.t);
    return samples;
  }

 private:
  /** After a jump right behind the start, ns. */
  static constexpr TimeNs kShortestStep = kNanosecondsPerSecond / 1000;
  /** A frame may come so much later than its IMU samples. */
  static constexpr double kLateS = 1.0;

  bool isAfterJump(TimeNs t) const { return t - from_ > (to_ - from_) / 2; }

  TimeNs from_ = 0, to_ = 0;  ///< of the jump
  TimeNs shift_ = 0;
  TimeNs step_ = 0;  ///< between the last two frames without a jump
  double jumped_s_ = 0.0;
};

}  // namespace etalon
