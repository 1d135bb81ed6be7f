#include "etalon/testing/example_benchmark.h"

namespace etalon::testing {

namespace {

StageRecord stageOf(const std::string& name, double gravity_deg, bool with_truth) {
  StageRecord stage;
  stage.stage = name;
  if (!with_truth) return stage;
  WindowErrors errors;
  errors.keyframes = 10;
  errors.gravity_deg = gravity_deg;
  errors.rre_deg = 0.1 * gravity_deg;
  errors.ate_m = errors.velocity_mps = 0.01 * gravity_deg;
  stage.errors = errors;
  return stage;
}

}  // namespace

WindowResult exampleResult(const std::string& sequence, int window, const std::string& initializer,
                           const ExampleOutcome& outcome) {
  WindowResult result;
  result.sequence = sequence;
  result.window = window;
  result.t0 = 2'500'000'000LL * window;
  result.keyframes = 10;
  result.rate_hz = 4.0;
  result.initializer = initializer;
  const bool with_truth = sequence != "none";
  if (with_truth) result.truth_check = {0.01 * (window + 1), 0.001 * (window + 1)};
  for (int k = 0; k < 10 && with_truth; ++k) {
    StampedState state;
    state.t = result.t0 + 250'000'000LL * k;
    if (window != 4) {
      state.T_WB.t.x() = 0.1 * k;
      state.v_WB.x() = 0.4;
    }
    result.truth.push_back(state);
  }
  AttemptRecord& attempt = result.attempt;
  attempt.timings = {{kTimingStereoOdometry, 10.0 + window}, {kTimingInitialize, 2.0}};
  if (!outcome.estimate) {
    attempt.status = "degenerate_motion";
    attempt.reason = "stands still";
    return result;
  }
  attempt.status = outcome.accepted ? kStatusSuccess : "diverged";
  attempt.stages = {stageOf(kStageInit, outcome.gravity_deg, with_truth),
                    stageOf(kStageViBa, 0.5 * outcome.gravity_deg, with_truth)};
  attempt.timings.push_back({kTimingViBa, 20.0});
  attempt.timings.push_back({"map", 1.5});
  result.noise = NoiseCheck{{400.0, 100.0}, {25.0, 100.0}, {100.0, 100.0}};
  return result;
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
  v1.ground_truth_check.interval_s = 0.25;
  v1.ground_truth_check.rre_deg = 0.0333;
  v1.ground_truth_check.world_tilt_deg = 0.25;
  v1.ground_truth_check.bias.gyro.z() = 0.08;
  v1.gyro_agreement = {0.08, 0.57};
  none.name = "none";
  record.sequences = {v1, none};
  const double good[] = {1.0, 2.0, 3.0, 1.5, 0.5}, bad[] = {2.0, 6.0, 0.0, 5.0, 1.5};
  for (int window = 0; window < 5; ++window) {
    record.results.push_back(exampleResult("V1", window, "good", {true, true, good[window]}));
    record.results.push_back(
        exampleResult("V1", window, "bad", {window != 2, window != 3, bad[window]}));
  }
  record.results.push_back(exampleResult("none", 0, "good", {true, true, 1.0}));
  record.results.push_back(exampleResult("none", 0, "bad", {false, false, 0.0}));
  return record;
}

}  // namespace etalon::testing
