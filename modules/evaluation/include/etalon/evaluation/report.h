#pragma once

#include <string>

#include "etalon/evaluation/benchmark_record.h"

namespace etalon {

/** The report of a benchmark: one HTML file that needs nothing else. */
std::string benchmarkReportHtml(const BenchmarkRecord& record);

}  // namespace etalon
