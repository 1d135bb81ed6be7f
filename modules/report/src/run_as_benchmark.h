#pragma once

#include "etalon/benchmark/record.h"
#include "etalon/core/trajectory.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/** A run as if it were a benchmark of one recording and one initializer: its attempts are the
 * windows. */
BenchmarkRecord benchmarkOfRun(const RunRecord& record, const GroundTruth& ground_truth);

}  // namespace etalon
