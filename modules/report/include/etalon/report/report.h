#pragma once

#include <string>

#include "etalon/benchmark/record.h"
#include "etalon/core/trajectory.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/**
 * The report of a benchmark: one HTML file that needs nothing else, no network either. Tables,
 * charts of every window, failures with their reasons, configuration. Valid UTF-8 whatever the
 * record's texts are.
 */
std::string benchmarkReportHtml(const BenchmarkRecord& record);

/**
 * The same kind of report for one run: its attempts take the place of windows, and the whole
 * trajectory stands beside them.
 * @param odometry T_WB of all frames; may be empty
 * @param ground_truth may be empty
 */
std::string runReportHtml(const RunRecord& record, const Trajectory& odometry,
                          const GroundTruth& ground_truth);

}  // namespace etalon
