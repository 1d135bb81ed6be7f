#pragma once

#include "etalon/benchmark/record.h"

namespace etalon::app {

/** Prints the recordings that could not be used to stderr. Returns whether there are any. */
bool printRecordingErrors(const SuiteRecord& record);

/** Prints what was found when the recordings were opened to stderr. */
void printRecordingWarnings(const SuiteRecord& record);

}  // namespace etalon::app
