#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/summary.h"
#include "etalon/evaluation/window_metrics.h"
#include "etalon/report/table.h"

namespace etalon {

struct TitledTable {
  std::string id;     ///< unique in a benchmark, e.g. "rre_deg_mean_10_4hz"
  std::string title;  ///< one line, which names the window
  std::string note;   ///< what to know when reading it; may be empty
  Table table;
  bool headline = false;    ///< one of the few tables to print where all are too many
  std::string figure = {};  ///< kSuccessRate or the key of an error; empty: neither
  /** The quantity in the table: `figure`, or e.g. "refusals", "runtime_ms". */
  std::string metric = {};
  std::string statistic = {};  ///< "mean", "median", "p90", "rate", "count"; empty: several
  int keyframes = 0;           ///< of the window; 0: of all
  double rate_hz = 0.0;
  bool marks_best = false;  ///< whether the best of a row is marked
};

/** A noise is called about right if it is at most this factor from what the residuals say. */
constexpr double kNoiseTolerance = 1.25;

/** How the noise in use compares with the residuals. */
struct NoiseVerdict {
  double chi2_per_dof = WindowErrors::kNone;
  double factor = WindowErrors::kNone;  ///< one step towards the right noise, not the final one
  std::string words;  ///< "too small", "about right", "too large"; empty without residuals
};

/** @param factor what to multiply the noise by (correctionOf); NaN: sqrt(chi2 / dof) */
NoiseVerdict noiseVerdict(const ResidualGroup& residuals, double factor = WindowErrors::kNone);

enum class SummaryStatistic { kMean, kMedian, kP90 };

/**
 * One error in the layout of the papers' tables: a row for each sequence and one over all windows,
 * the initializers beside each other without and with VI-BA, the best of each in bold. A further
 * column has the lower bound of RRE or b_g (truthCheck()), or the tilt of the ground truth's world,
 * where there is one.
 * @param summary summarize(record)
 */
TitledTable errorTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                       WindowShape shape, const WindowMetric& metric, SummaryStatistic statistic);

/**
 * The tables of a benchmark. For every window: success, good estimates (with VI-BA) and refusals;
 * every error by mean, median and 90th percentile (see errorTable()); NEES of tilt and velocity;
 * run time; the check of the noise. Then the ground truth of every sequence against its IMU. A
 * note says which recordings are too short for the window.
 */
std::vector<TitledTable> benchmarkTables(const BenchmarkRecord& record);

/** The note, and which cells are marked and how, e.g. "in bold". */
std::string noteOf(const TitledTable& table, const std::string& mark = "in bold");

/** The table with its title and its note. CSV: the table alone. */
std::string toString(const TitledTable& table, TableFormat format, const TextStyle& style = {});

/**
 * All figures of a benchmark's tables as one CSV table, a number a line (docs/evaluation.md):
 * metric, statistic, keyframes, rate_hz, windows, sequence, initializer, stage, count, value. No
 * two lines have the same text before `count`.
 */
std::string benchmarkTablesCsv(const BenchmarkRecord& record);

}  // namespace etalon
