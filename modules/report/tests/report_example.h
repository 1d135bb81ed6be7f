#pragma once

#include "etalon/benchmark/record.h"
#include "etalon/core/trajectory.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon::testing {

/** The size of a made-up benchmark. */
struct ReportExampleSize {
  int sequences = 7;  ///< the last but one has no ground truth, the last could not be used
  int windows = 60;
  int initializers = 7;
  std::vector<int> keyframes{5, 10};
  std::vector<double> rates_hz{4.0, 10.0};
};

/**
 * A benchmark that never ran, the same on every call: a body on a curved path, estimates with
 * random errors, stretches in which initializers refuse, are not accepted, or are wrong.
 */
BenchmarkRecord reportExample(const ReportExampleSize& size);

/** A run made up in the same way: some refusals, then a start, later a second without images. The
 * errors are two thirds of the predicted ones. */
struct RunExample {
  RunRecord record;
  std::vector<FrameEstimate> estimates;
  GroundTruth ground_truth;
};
RunExample runExample();

}  // namespace etalon::testing
