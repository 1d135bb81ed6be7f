#pragma once

#include <cmath>
#include <cstdint>

namespace etalon {

/** Absolute time on the sensor clock, nanoseconds. Never held in a double. */
using TimeNs = std::int64_t;

constexpr TimeNs kNanosecondsPerSecond = 1'000'000'000;

/** The last stamp that readers of files accept, in the year 2096: sums and differences of two
 * stamps stay inside TimeNs. The first one is 0. */
constexpr TimeNs kLastStamp = 4'000'000'000 * kNanosecondsPerSecond;

/** Whether a reader may accept `t` as a stamp. */
constexpr bool isStamp(TimeNs t) { return 0 <= t && t <= kLastStamp; }

/** `to - from` in seconds. */
inline double secondsBetween(TimeNs from, TimeNs to) {
  return static_cast<double>(to - from) * 1e-9;
}

/** A duration in seconds as nanoseconds, rounded to the nearest. */
inline TimeNs durationNs(double seconds) {
  return static_cast<TimeNs>(std::llround(seconds * 1e9));
}

/** MRPT's clock counts ticks of 100 ns. */
constexpr TimeNs kMrptTickNs = 100;

/** `t` cut down to MRPT's tick: the stamp that a rawlog can hold. */
constexpr TimeNs truncateToMrptTick(TimeNs t) { return t - t % kMrptTickNs; }

}  // namespace etalon
