#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/report/table.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/**
 * One row for each run and stage (`init`, `vi_ba`) of its accepted attempt, else of the last one
 * that has a stage. A run whose attempts have none has one row, with the last attempt's status.
 * Text and Markdown leave the source out where it is the same for all, and the status where all
 * succeeded.
 * @param runs name (e.g. the folder) and record of each
 */
Table compareRuns(const std::vector<std::pair<std::string, RunRecord>>& runs);

/** The same for a screen: a row a run, the stages beside each other, the figures that decide about a
 * start, and the ATE of the whole trajectory. The initializer stands there where a run has not its
 * name. */
Table compareRunsBriefly(const std::vector<std::pair<std::string, RunRecord>>& runs);

/** A sentence for each run that never initialized: how many attempts, and why the last failed. */
std::vector<std::string> refusalsOf(const std::vector<std::pair<std::string, RunRecord>>& runs);

}  // namespace etalon
