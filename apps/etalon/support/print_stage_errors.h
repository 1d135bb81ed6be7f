#pragma once

#include "etalon/runlog/initialization_json.h"

namespace etalon::app {

/** Prints a line with the known errors of a stage, and the number of keyframes with ground truth if
 * some have none. Prints nothing for a stage without ground truth. */
void printStageErrors(const StageRecord& stage);

}  // namespace etalon::app
