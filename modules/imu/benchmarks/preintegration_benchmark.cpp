#include <benchmark/benchmark.h>

#include "../tests/analytic_motion.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

constexpr TimeNs kStep = 5'000'000;  // 200 Hz

/** Argument: steps of 5 ms; 50 is the quarter second between keyframes. */
void preintegrate(benchmark::State& state) {
  const std::vector<ImuSample> samples =
      AnalyticMotion().samples(evenStamps(0, kStep, static_cast<int>(state.range(0))));
  for (auto _ : state) {
    const Preintegration p(samples, {}, ImuNoiseDensities());
    benchmark::DoNotOptimize(p.covariance().data());
  }
}
BENCHMARK(preintegrate)->Arg(10)->Arg(50)->Arg(200)->Unit(benchmark::kMicrosecond);

/** A quarter second cut from three minutes of samples. */
void cutInterval(benchmark::State& state) {
  const ImuBuffer buffer(AnalyticMotion().samples(evenStamps(0, kStep, 36'000)));
  TimeNs t = 0;
  for (auto _ : state) {
    t = (t + 7'919'000'001) % (170 * kNanosecondsPerSecond);
    const std::vector<ImuSample> samples = buffer.between(t, t + 50 * kStep);
    benchmark::DoNotOptimize(samples.data());
  }
}
BENCHMARK(cutInterval)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace etalon
