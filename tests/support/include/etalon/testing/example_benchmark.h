#pragma once

#include "etalon/benchmark/record.h"

namespace etalon::testing {

/** What an initializer made of a window of the example. */
struct ExampleOutcome {
  bool estimate = true, accepted = true;
  double gravity_deg = 1.0;  ///< before VI-BA; half of it after, like the other errors
};

/** A window of 10 keyframes at 4 Hz; the other errors follow from gravity_deg: RRE is a tenth of
 * it, ATE [m] and velocity [m/s] a hundredth. */
WindowResult exampleResult(const std::string& sequence, int window, const std::string& initializer,
                           const ExampleOutcome& outcome);

/**
 * "V1" (ground truth, velocities): five windows; in the last one the body rests. "none" (no ground
 * truth): one window.
 *
 *     gravity_deg of V1   window 0   1     2         3              4 (at rest)
 *     good                1        2     3         1.5            0.5
 *     bad                 2        6     refused   not accepted   1.5      (window 3: 5)
 *
 * In "none" good gives an estimate, bad refuses.
 */
BenchmarkRecord exampleBenchmark();

}  // namespace etalon::testing
