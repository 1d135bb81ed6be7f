#pragma once

#include <mrpt/core/Clock.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "etalon/core/time.h"

namespace etalon {

/** Ticks of 100 ns between the epoch of MRPT's clock (1601-01-01) and Unix's (1970-01-01). */
constexpr std::int64_t kMrptTicksAtUnixEpoch = 116'444'736'000'000'000;

/** `t` on MRPT's clock, cut down to its tick of 100 ns (see truncateToMrptTick), by integers only.
 */
inline mrpt::Clock::time_point toMrptTime(TimeNs t) {
  return mrpt::Clock::time_point(mrpt::Clock::duration(t / kMrptTickNs + kMrptTicksAtUnixEpoch));
}

/** The inverse; exact for the years 1678 to 2261, for others the nearest that TimeNs holds. */
inline TimeNs fromMrptTime(mrpt::Clock::time_point t) {
  constexpr std::int64_t kMostTicks = std::numeric_limits<TimeNs>::max() / kMrptTickNs;
  const std::int64_t ticks =
      std::clamp(t.time_since_epoch().count(), kMrptTicksAtUnixEpoch - kMostTicks,
                 kMrptTicksAtUnixEpoch + kMostTicks);
  return (ticks - kMrptTicksAtUnixEpoch) * kMrptTickNs;
}

}  // namespace etalon
