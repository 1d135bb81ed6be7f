#pragma once

#include <string>
#include <vector>

#include "etalon/pipeline/pipeline.h"
#include "etalon/report/run_results.h"
#include "etalon/runlog/initialization_json.h"
#include "support/supervised_run.h"

namespace etalon::app {

/** The live line: time in the recording, frames per second, state. */
std::string describeProgress(const Pipeline& pipeline, const PipelineOptions& options,
                             double seconds, double elapsed_s);

/**
 * Prints what an attempt of the pipeline has started if it was accepted, or why not yet.
 *
 * @param at_rest name of the initializer at rest; empty if there is none
 */
void printAttempt(const InitializationAttempt& attempt, const Pipeline& pipeline,
                  const std::string& at_rest, TimeNs first_image);

/** Prints a change of the pipeline's state and the jump of the pose that came with it. */
void printEvent(const PipelineEvent& event, TimeNs first_image);

/** Prints what a finished run found, what was wrong with its input, and the files written.
 * @param part whether the run was to be of a part of the recording, or was interrupted */
void printSummary(const RunRecord& record, const FinishedRun& run,
                  const std::vector<std::string>& files, bool part);

/** "misbehaves crashed with signal 11 (Segmentation fault) at 2.25 s of RECORDING, in its attempt
 * number 3". */
std::string describe(const RunEnd& end, const std::string& source);

}  // namespace etalon::app
