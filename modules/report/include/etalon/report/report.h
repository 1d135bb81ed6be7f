#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/trial/trial_record.h"
#include "etalon/core/trajectory.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/**
 * The report of a benchmark: one HTML file that needs no other file and no network. It has tables,
 * charts of every window, failures with their reasons, and the configuration. It is valid UTF-8
 * whatever the record's texts are.
 */
std::string benchmarkReportHtml(const BenchmarkRecord& record);

/**
 * The report of one run: the flight from above, states and events over time, errors beside the
 * predicted ones, times of each stage, attempts.
 * @param estimates of all frames; may be empty
 * @param ground_truth may be empty
 */
std::string runReportHtml(const RunRecord& record, const std::vector<FrameEstimate>& estimates,
                          const GroundTruth& ground_truth);

/**
 * The report of a trial: ATE by fault, errors after the start, the trajectories of every part beside
 * each other, the tables, every failure with its reason.
 * @param folder of the trial, which has the trajectories
 */
std::string trialReportHtml(const TrialRecord& record, const std::string& folder);

}  // namespace etalon
