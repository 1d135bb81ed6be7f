#pragma once

#include <string>

#include "etalon/benchmark/trial/trial_record.h"

namespace etalon::testing {

/** A run that survived, with an ATE of `ate_mm`, and half of that for the smoothed trajectory. */
inline TrialRun exampleRun(const std::string& recording, double from_s, const TrialVariant& variant,
                           const std::string& fault, double ate_mm) {
  TrialRun run;
  run.recording = recording;
  run.from_s = from_s;
  run.variant = variant;
  run.fault = fault;
  run.status = kStatusSurvived;
  run.images = run.frames = run.poses = 200;
  run.seconds = 10.0;
  run.started_s = 0.75;
  run.end_state = "inertial";
  run.causal.ate_m = 1e-3 * ate_mm;
  run.smoothed.ate_m = 0.5e-3 * ate_mm;
  if (fault != kNoFault) {
    run.fault_at_s = 5.0;
    run.event = "at 5.00 s dead_reckoning: the images show no landmark, a comma";
  }
  for (const double after_s : timesAfterStart())
    run.after_start.push_back({after_s, 1e-3 * ate_mm, 0.004, 0.5});
  run.frame_ms = 7.0;
  return run;
}

/**
 * Recordings "a" and "b", two starts each, initializers "one" and "two", without a fault and with
 * "dark": 16 runs. ATE [mm]: `one` has 2 without a fault and 5 with it, `two` 3 and 7; "b" has one
 * more than "a". The last run failed.
 */
inline TrialRecord exampleTrial() {
  TrialRecord record;
  record.protocol.seconds = 10.0;
  record.protocol.starts = 2;
  record.binaries = "program";
  record.config = "[pipeline]\n";
  record.settings = {{"", "[pipeline]\n"}};
  record.odometries = {"fixed_lag"};
  record.initializers = {{"one", "1", "", "plugin", ""}, {"two", "1", "", "plugin", ""}};
  record.faults = {{kNoFault, ""}, {"dark", "covered from=5 for=1"}};
  for (const char* name : {"a", "b"}) {
    BenchmarkSequence sequence;
    sequence.name = name;
    sequence.content = std::string("content of ") + name;
    sequence.last_image = durationNs(30.0);
    sequence.stereo_frames = 601;
    record.sequences.push_back(sequence);
    for (const double from_s : startsOf(record.protocol, sequence))
      for (const TrialVariant& variant : variantsOf(record))
        for (const NamedText& fault : record.faults) {
          const bool one = variant.initializer == "one", none = fault.name == kNoFault;
          record.results.push_back(exampleRun(name, from_s, variant, fault.name,
                                              (one ? (none ? 2.0 : 5.0) : (none ? 3.0 : 7.0)) +
                                                  (sequence.name == "b" ? 1.0 : 0.0)));
        }
  }
  TrialRun& last = record.results.back();
  last.status = kStatusFailed;
  last.silent = true;
  last.reason = "silent: off by 0.62 m at 7.10 s, 8 times the predicted 0.080 m";
  last.event = "";
  last.poses = 150;
  return record;
}

}  // namespace etalon::testing
