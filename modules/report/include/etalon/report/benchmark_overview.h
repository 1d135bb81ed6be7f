#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/report/benchmark_comparison.h"
#include "etalon/report/benchmark_tables.h"

namespace etalon {

/** The figures of an overview: success and the errors that decide about a start. */
std::vector<std::string> overviewFigures();

/**
 * What a benchmark says on one screen: a row for each initializer over all windows of a shape, no
 * wider than 100 characters with names of up to 22. Success [%], medians of RRE [deg], ATE [mm],
 * gravity [deg], velocity [m/s] and run time [ms], without and with VI-BA; the best of a column is
 * marked.
 * @param summary summarize(record)
 */
TitledTable overviewTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                          const WindowShape& shape);

/**
 * A row for each initializer that was compared with the first, a column for each figure and stage:
 * "better" or "worse" than the first, "=" where no relevant difference is significant, "few" with
 * too few pairs to tell.
 * @param comparisons of one shape
 */
TitledTable comparisonOverview(const std::vector<PairedComparison>& comparisons,
                               const BootstrapOptions& options);

/** The terms of the tables, a line each, for a command's help. */
std::string glossary();

}  // namespace etalon
