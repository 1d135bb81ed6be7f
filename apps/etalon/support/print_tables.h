#pragma once

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/trial/trial_record.h"
#include "etalon/report/benchmark_tables.h"

namespace etalon::app {

/**
 * The style of text on stdout. Cells are marked by a terminal's bold where stdout is a terminal
 * that has it (TERM is not "dumb") and NO_COLOR is empty, else by `*`. The width is COLUMNS, else
 * the terminal's, else 120.
 * @param bold use bold whatever stdout is
 */
TextStyle textStyle(bool bold = false);

/** Prints overviewTable() of each shape of window to stdout. */
void printOverview(const BenchmarkRecord& record, const TextStyle& style);

/** Prints a benchmark's tables to stdout: as text one table for each shape of window, or with
 * `verbose` all headlines; all in one table as CSV. */
void printBenchmarkTables(const BenchmarkRecord& record, TableFormat format, bool verbose);

/** Prints a trial's tables to stdout: as text its page, or with `verbose` all of them; as CSV all
 * runs. @param bold as of textStyle() */
void printTrialTables(const TrialRecord& record, TableFormat format, bool verbose,
                      bool bold = false);

/** Says on stderr in how many windows (runs) an initializer crashed or used up its time. Returns
 * whether there are any. */
bool printLost(const BenchmarkRecord& record);
bool printLost(const TrialRecord& record);

/** Prints what a benchmark left out to stderr: unreadable images, recordings too short for a
 * window, windows without enough ground truth. */
void printShortfalls(const BenchmarkRecord& record);

/** The same of a trial: recordings too short for a run, runs that do not count. */
void printShortfalls(const TrialRecord& record);

}  // namespace etalon::app
