#pragma once

#include <string>
#include <vector>

#include "etalon/pipeline/pipeline.h"
#include "etalon/runlog/initialization_json.h"
#include "support/supervised_run.h"

namespace etalon::app {

/** The live line: time in the recording, frames per second, state. */
std::string describeProgress(const Pipeline& pipeline, const PipelineOptions& options,
                             double seconds, double elapsed_s);

/**
 * Prints whether the attempt was accepted, or why not yet.
 *
 * @param accepted what it has done if it was
 * @param waits_for_motion whether the odometry runs from a start at rest, and this attempt by the
 *        initializer at rest says why that is not over
 */
void printAttempt(const InitializationAttempt& attempt, TimeNs first_image,
                  const std::string& accepted, bool waits_for_motion);

/** Prints a change of the pipeline's state and the jump of the pose that came with it. */
void printEvent(const PipelineEvent& event, TimeNs first_image);

/** Prints what a finished run found, what was wrong with its input, and the files written.
 * @param part whether the run was to be of a part of the recording, or was interrupted */
void printSummary(const RunRecord& record, const std::vector<std::string>& files, bool part);

/** "misbehaves crashed with signal 11 (Segmentation fault) at 2.25 s of RECORDING, in its attempt
 * number 3". */
std::string describe(const RunEnd& end, const std::string& source);

}  // namespace etalon::app
