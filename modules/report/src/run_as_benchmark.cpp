#include "run_as_benchmark.h"

#include <cmath>
#include <string>

namespace etalon {

BenchmarkRecord benchmarkOfRun(const RunRecord& record, const GroundTruth& ground_truth) {
  BenchmarkRecord benchmark;
  benchmark.versions = record.versions;
  benchmark.config = record.config;
  benchmark.protocol.vi_ba = false;
  BenchmarkSequence sequence;
  const std::string source = record.source.substr(0, record.source.find_last_not_of('/') + 1);
  sequence.name = source.substr(source.rfind('/') + 1);
  sequence.source = record.source;
  sequence.source_kind = record.source_kind;
  sequence.first_image = record.first_image;
  sequence.duration_s = record.statistics.duration_s;
  sequence.stereo_frames = record.statistics.stereo_frames;
  sequence.unreadable_images = record.statistics.unreadable_images;
  sequence.has_ground_truth = !ground_truth.empty();
  sequence.warnings = record.warnings;
  benchmark.sequences = {sequence};
  BenchmarkInitializer initializer;
  initializer.name = record.initializer;
  initializer.version = record.initializer_version;
  benchmark.initializers = {initializer};

  WindowResult result;
  result.sequence = sequence.name;
  result.initializer = initializer.name;
  for (const AttemptRecord& attempt : record.attempts) {
    const int keyframes = attempt.keyframes.size();
    if (keyframes <= result.keyframes || keyframes < 2) continue;
    result.keyframes = keyframes;
    const double span_s = secondsBetween(attempt.keyframes.front(), attempt.keyframes.back());
    if (span_s > 0) result.rate_hz = std::round(100.0 * (keyframes - 1) / span_s) / 100.0;
  }
  for (const AttemptRecord& attempt : record.attempts) {
    result.t0 = attempt.keyframes.empty() ? attempt.t : attempt.keyframes.front();
    result.attempt = attempt;
    result.truth.clear();
    for (const TimeNs t : attempt.keyframes)
      if (const auto state = ground_truth.at(t)) result.truth.push_back(*state);
    benchmark.results.push_back(result);
    if (attempt.stage(kStageViBa) != nullptr) benchmark.protocol.vi_ba = true;
    ++result.window;
  }
  return benchmark;
}

}  // namespace etalon
