#pragma once

#include "etalon/benchmark/benchmark_record.h"

namespace etalon::testing {

/** What an initializer made of a slot of the example. */
struct ExampleOutcome {
  bool estimate = true, accepted = true;
  double gravity_deg = 1.0;  ///< before VI-BA; half of it after, like the other errors
};

/** A slot of 10 keyframes at 4 Hz; the other errors follow from gravity_deg: RRE is a tenth of it,
 * ATE [m] and velocity [m/s] a hundredth. */
SlotRecord exampleSlot(const std::string& sequence, int segment, const std::string& initializer,
                       const ExampleOutcome& outcome);

/**
 * "V1" (ground truth, velocities): five slots; in the last one the body rests. "none" (no ground
 * truth): one slot.
 *
 *     gravity_deg of V1   slot 0   1     2         3              4 (at rest)
 *     good                1        2     3         1.5            0.5
 *     bad                 2        6     refused   not accepted   1.5      (slot 3: 5)
 *
 * In "none" good gives an estimate, bad refuses.
 */
BenchmarkRecord exampleBenchmark();

}  // namespace etalon::testing
