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
  void jump(TimeNs from, TimeNs to) { jumped_s_ += std::abs(secondsBetween(from, to)); }
  /** The next frame. The true time across a jump is unknown: the step of the frames before is
   * taken. */
  void frame(TimeNs before, TimeNs t) {
    if (hasJumped())
      shift_ += t - before - std::max(step_, kShortestStep);
    else
      step_ = t - before;
  }
  /** What jumped is behind the last frame. */
  void frameDone() { jumped_s_ = 0.0; }

  /** Whether it has since the last frame, and by how much, s. */
  bool hasJumped() const { return jumped_s_ > 0.0; }
  double jumpedSeconds() const { return jumped_s_; }

  TimeNs at(TimeNs stamp) const { return stamp - shift_; }
  std::vector<ImuSample> at(std::vector<ImuSample> samples) const {
    for (ImuSample& sample : samples) sample.t = at(sample.t);
    return samples;
  }

 private:
  /** After a jump right behind the start, ns. */
  static constexpr TimeNs kShortestStep = kNanosecondsPerSecond / 1000;

  TimeNs shift_ = 0;
  TimeNs step_ = 0;  ///< between the last two frames without a jump
  double jumped_s_ = 0.0;
};

}  // namespace etalon
