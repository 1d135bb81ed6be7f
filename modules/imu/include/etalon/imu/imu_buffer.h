#pragma once

#include <vector>

#include "etalon/imu/imu_sample.h"

namespace etalon {

/** Time-ordered IMU samples of a run, from which intervals are cut. */
class ImuBuffer {
 public:
  ImuBuffer() = default;
  /** Throws DataError unless the stamps increase strictly. */
  explicit ImuBuffer(std::vector<ImuSample> samples);

  /** Appends a sample; its stamp must be later than the last one's (DataError otherwise). */
  void add(const ImuSample& sample);

  /** Drops what no interval from `t` on needs; the last sample at or before `t` is kept. */
  void dropBefore(TimeNs t);

  bool empty() const { return samples_.empty(); }
  const std::vector<ImuSample>& samples() const { return samples_; }

  /** Whether [t0, t1] lies inside the recorded time. */
  bool covers(TimeNs t0, TimeNs t1) const;

  /**
   * Samples of [t0, t1]: one exactly at t0 and one exactly at t1 (linearly interpolated where none
   * was recorded) and all between. Empty if the buffer does not cover the interval or t1 <= t0.
   */
  std::vector<ImuSample> between(TimeNs t0, TimeNs t1) const;

  /** The longest step between samples of between(t0, t1), s; infinite if not covered. */
  double longestGap(TimeNs t0, TimeNs t1) const;

 private:
  std::vector<ImuSample> samples_;
};

}  // namespace etalon
