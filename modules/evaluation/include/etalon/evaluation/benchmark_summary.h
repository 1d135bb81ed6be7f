#pragma once

#include <string>
#include <vector>

#include "etalon/evaluation/benchmark_record.h"

namespace etalon {

/** summary.csv: statistics of the segments by sequence (and `all`), window, initializer and stage
 * (docs/evaluation.md). */
std::string summaryCsv(const BenchmarkRecord& record);

}  // namespace etalon
