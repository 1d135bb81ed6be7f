#include "etalon/testing/example_benchmark.h"

namespace etalon::testing {

namespace {

StageRecord stageOf(const std::string& name, double gravity_deg, bool with_truth) {
  StageRecord stage;
  stage.stage = name;
  if (!with_truth) return stage;
  SegmentErrors errors;
  errors.keyframes = 10;
  errors.gravity_deg = gravity_deg;
  errors.rre_deg = 0.1 * gravity_deg;
  errors.ate_m = errors.velocity_mps = 0.01 * gravity_deg;
  stage.errors = errors;
  return stage;
}

}  // namespace

SlotRecord exampleSlot(const std::string& sequence, int segment, const std::string& initializer,
                       const ExampleOutcome& outcome) {
  SlotRecord slot;
  slot.sequence = sequence;
  slot.segment = segment;
  slot.t0 = 2'500'000'000LL * segment;
  slot.keyframes = 10;
  slot.rate_hz = 4.0;
  slot.initializer = initializer;
  const bool with_truth = sequence != "none";
  if (with_truth) slot.gyro_floor = {0.01 * (segment + 1), 0.001 * (segment + 1)};
  for (int k = 0; k < 10 && with_truth; ++k) {
    GroundTruthState state;
    state.t = slot.t0 + 250'000'000LL * k;
    if (segment != 4) {
      state.T_WB.t.x() = 0.1 * k;
      state.v_WB.x() = 0.4;
    }
    slot.truth.push_back(state);
  }
  AttemptRecord& attempt = slot.attempt;
  attempt.timings = {{kTimingVisualOdometry, 10.0 + segment}, {kTimingInitialize, 2.0}};
  if (!outcome.estimate) {
    attempt.status = "degenerate_motion";
    attempt.reason = "stands still";
    return slot;
  }
  attempt.status = outcome.accepted ? kStatusSuccess : "diverged";
  attempt.stages = {stageOf(kStageInit, outcome.gravity_deg, with_truth),
                    stageOf(kStageViBa, 0.5 * outcome.gravity_deg, with_truth)};
  attempt.timings.push_back({kTimingViBa, 20.0});
  attempt.timings.push_back({"map", 1.5});
  slot.noise = NoiseCheck{{400.0, 100.0}, {25.0, 100.0}, {100.0, 100.0}};
  return slot;
}

BenchmarkRecord exampleBenchmark() {
  BenchmarkRecord record;
  for (const char* name : {"good", "bad"}) {
    record.initializers.emplace_back();
    record.initializers.back().name = name;
  }
  BenchmarkSequence v1, none;
  v1.name = "V1";
  v1.has_ground_truth = true;
  v1.floor.interval_s = 0.25;
  v1.floor.rre_deg = 0.0333;
  v1.floor.world_tilt_deg = 0.25;
  v1.floor.bias.gyro.z() = 0.08;
  v1.gyro_agreement = {0.08, 0.57};
  none.name = "none";
  record.sequences = {v1, none};
  const double good[] = {1.0, 2.0, 3.0, 1.5, 0.5}, bad[] = {2.0, 6.0, 0.0, 5.0, 1.5};
  for (int segment = 0; segment < 5; ++segment) {
    record.slots.push_back(exampleSlot("V1", segment, "good", {true, true, good[segment]}));
    record.slots.push_back(
        exampleSlot("V1", segment, "bad", {segment != 2, segment != 3, bad[segment]}));
  }
  record.slots.push_back(exampleSlot("none", 0, "good", {true, true, 1.0}));
  record.slots.push_back(exampleSlot("none", 0, "bad", {false, false, 0.0}));
  return record;
}

}  // namespace etalon::testing
