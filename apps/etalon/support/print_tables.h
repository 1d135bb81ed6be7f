#pragma once

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/report/benchmark_tables.h"

namespace etalon::app {

/**
 * For text on stdout. Marks: a terminal's bold where stdout is a terminal that has it (TERM is not
 * "dumb") and nobody asked for less (NO_COLOR is empty), else `*`. Width: COLUMNS, else the
 * terminal's, else 120.
 * @param bold bold whatever stdout is
 */
TextStyle textStyle(bool bold = false);

/** Prints a benchmark's tables to stdout: as text the headlines alone, JSON and CSV as one
 * document. */
void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format);

/** Says on stderr in how many windows an initializer crashed or used up its time; whether there are
 * any. */
bool printLostWindows(const BenchmarkRecord& record);

/** What a benchmark left out, to stderr: unreadable images, recordings too short for a window,
 * windows without enough ground truth. */
void printShortfalls(const BenchmarkRecord& record, double min_coverage);

}  // namespace etalon::app
