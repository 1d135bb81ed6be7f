#pragma once

#include <string>
#include <vector>

#include "etalon/evaluation/benchmark_record.h"
#include "etalon/evaluation/benchmark_summary.h"
#include "etalon/evaluation/segment_metrics.h"
#include "etalon/evaluation/table.h"

namespace etalon {

struct TitledTable {
  std::string id;     ///< unique in a benchmark, e.g. "rre_deg_mean_10_4hz"
  std::string title;  ///< one line, with the window it speaks of
  std::string note;   ///< what to know when reading it; may be empty
  Table table;
  bool headline = false;    ///< one of the few to print where all would be too many
  std::string figure = {};  ///< kSuccessRate or the key of an error; empty: neither
};

/** A noise is called about right if it is at most this factor from what the residuals say. */
constexpr double kNoiseTolerance = 1.25;

/** The noise in use against the residuals. */
struct NoiseVerdict {
  double chi2_per_dof = SegmentErrors::kNone;
  double factor = SegmentErrors::kNone;  ///< one step towards the noise, not where it ends
  std::string words;  ///< "too small", "about right", "too large"; empty without residuals
};

/** @param factor what to multiply the noise by (correctionOf); NaN: sqrt(chi2 / dof) */
NoiseVerdict noiseVerdict(const ResidualGroup& residuals, double factor = SegmentErrors::kNone);

enum class SummaryStatistic { kMean, kMedian, kP90 };

/**
 * One error in the layout of the papers' tables: a row a sequence and one over all slots, the
 * initializers beside each other without and with VI-BA, the best of each in bold; where there is
 * one, the gyro's best RRE (gyroFloor()) or the tilt of the ground truth's world beside it.
 * @param summary summarize(record)
 */
TitledTable errorTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                       std::pair<int, double> window, const SegmentMetric& metric,
                       SummaryStatistic statistic);

/**
 * The tables of a benchmark. For every window: success and refusals; every error by mean, median
 * and 90th percentile (see errorTable()); run time; the check of the noise. Then the floor of the
 * ground truth of every sequence.
 */
std::vector<TitledTable> benchmarkTables(const BenchmarkRecord& record);

/** The table with its title and its note. CSV and JSON: the table alone. */
std::string toString(const TitledTable& table, TableFormat format, bool terminal_bold = false);

}  // namespace etalon
