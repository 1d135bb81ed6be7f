#pragma once

#include "etalon/runlog/run_log.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon::testing {

constexpr TimeNs kFirstImage = 1403636584763555584;  // not a multiple of MRPT's tick

/** Every member filled with numbers that differ; one refused attempt, one accepted one. */
RunRecord exampleRecord();

/** The record with poses at 20 Hz for half a second, ground truth and references to images. */
RunLog exampleLog();

}  // namespace etalon::testing
