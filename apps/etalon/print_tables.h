#pragma once

#include "etalon/evaluation/benchmark_tables.h"

namespace etalon::app {

/** Prints a benchmark's tables to stdout; as text the headlines alone. */
void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format);

}  // namespace etalon::app
