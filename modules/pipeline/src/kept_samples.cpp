#include "kept_samples.h"

#include "etalon/core/time.h"

namespace etalon {

void keepSample(const ImuSample& sample, const std::optional<TimeNs>& last_frame, ImuBuffer* imu) {
  imu->add(sample);
  const TimeNs longest = durationNs(kLongestGapOfFramesS), needed = sample.t - longest;
  const TimeNs oldest = imu->samples().front().t;
  // A camera whose clock is ahead may stop.
  if (last_frame && *last_frame >= needed && oldest >= needed - longest) return;
  const bool is_worth_it = oldest < needed - kNanosecondsPerSecond;
  if (is_worth_it) imu->dropBefore(needed);
}

}  // namespace etalon
