#pragma once

#include <optional>
#include <string>
#include <utility>

#include "etalon/report/benchmark_tables.h"

// The tables of a benchmark that are not in the papers' layout. See benchmarkTables().

namespace etalon {

constexpr const char* kWithout = "without VI-BA";
constexpr const char* kWith = "with VI-BA";

/** The title above the columns of a stage. */
inline std::string groupOf(const std::string& stage) {
  return stage == kStageInit ? kWithout : kWith;
}

/** In words: "90th percentile". */
std::string nameOf(SummaryStatistic statistic);
double valueOf(const FigureSummary& figure, SummaryStatistic statistic);

/** Whether an initializer's figures can be the best: a method that answers only where it is easy is
 * not. It has an estimate in three quarters of the windows. */
inline bool canBeBest(const SummaryRow& row) { return row.estimates >= 0.75 * row.count; }

std::string shapeText(const WindowShape& shape);
/** For TitledTable::id. */
std::string shapeId(const WindowShape& shape);

/** Times of stereo odometry, initializer, its own stages and VI-BA over all sequences. */
TitledTable runtimePartsTable(const BenchmarkRecord& record, const WindowShape& shape);

/** The first initializer that has a check of the noise; empty if none has. */
std::string checkedInitializer(const BenchmarkRecord& record, const WindowShape& shape);

/** Compares the noise in use with the residuals after the first initializer that has a check;
 * nothing if none has. */
std::optional<TitledTable> noiseTable(const BenchmarkRecord& record, const WindowShape& shape);

/** Explains the column beside an error in sentences. @param key of RRE, gyro bias or gravity */
std::string boundNote(const BenchmarkRecord& record, const std::string& key);

/** The quality of each sequence's ground truth. */
TitledTable groundTruthTable(const BenchmarkRecord& record);

}  // namespace etalon
