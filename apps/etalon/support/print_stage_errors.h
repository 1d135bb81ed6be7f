#pragma once

#include "etalon/runlog/initialization_json.h"

namespace etalon::app {

/** Prints a line with the errors of a stage that are known, and at how many keyframes there is
 * ground truth if not at all of them; nothing of a stage without ground truth. */
void printStageErrors(const StageRecord& stage);

}  // namespace etalon::app
