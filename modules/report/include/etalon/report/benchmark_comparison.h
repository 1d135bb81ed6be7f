#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "etalon/benchmark/paired_bootstrap.h"
#include "etalon/benchmark/record.h"
#include "etalon/report/benchmark_tables.h"

namespace etalon {

/** With fewer pairs not even the same sign in all of them is significant (two-sided sign test:
 * 2^(1-n) > 0.05 up to n = 5). */
constexpr int kMinPairs = 6;

/** A difference of two medians below this share of the smaller one is not relevant. */
constexpr double kRelevantShare = 0.01;

/**
 * Combines several benchmarks into one, to compare them. An initializer that is in more than one of
 * them is called "<benchmark>/<initializer>". The largest of their shares of keyframes that need
 * ground truth holds for all.
 * @param benchmarks name and record of each
 * @throws ConfigError if a sequence of the same name is another recording in another benchmark
 */
BenchmarkRecord combineBenchmarks(
    const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks);

/**
 * The record with only these initializers, in this order.
 * @throws ConfigError listing the record's initializers, if it has no result of one
 */
BenchmarkRecord selectInitializers(const BenchmarkRecord& record,
                                   const std::vector<std::string>& names);

constexpr int kSuccessDecimals = 1;  ///< of a rate in percent, where it is printed

/** With fewer recordings the interval is too narrow where recordings differ (docs/evaluation.md),
 * and even the same sign in all of them would not be significant (see kMinPairs). */
constexpr int kMinRecordings = 6;

/** The contribution of one recording to a comparison. */
struct RecordingDifference {
  std::string sequence;
  int pairs = 0;
  double difference = WindowErrors::kNone;  ///< of a - b: of the rates, or median of the errors
};

/** Two initializers on the windows that both have: same sequence, window and first keyframe; or two
 * variants of a trial on the runs that both have. */
struct PairedComparison {
  std::string a, b;
  int keyframes = 0;
  double rate_hz = 0.0;
  std::string stage;
  std::string figure;  ///< kSuccessRate or a key of windowMetrics()
  /** Windows with the figure on either side; interval.pairs: on both. */
  int count_a = 0, count_b = 0;
  /** Over the pairs: rate of success, or median of the error. */
  double value_a = WindowErrors::kNone, value_b = WindowErrors::kNone;
  /** Of a - b: difference of the rates; median of the differences of the errors. */
  BootstrapInterval interval;
  int apart = 0;  ///< lower bound of the number of pairs whose windows (runs) do not overlap
  std::vector<RecordingDifference> by_recording;  ///< those with a pair, in the record's order

  /** Smaller differences are not relevant, however significant they are. Errors: kRelevantShare of
   * the smaller median, but at least the last digit that the tables print. Success: that digit. */
  double smallestRelevantDifference() const;
  /** "<a> is better", "<b> is better", "no relevant difference" (significant, but too small), "no
   * significant difference" or "too few pairs" (fewer than kMinPairs whose windows do not overlap).
   * ", this recording alone" follows where a difference was found and there is one recording. */
  std::string verdict() const;
};

/** A figure by recording and by the start of its window or run, where it is known. */
using FiguresByStart = std::map<std::pair<std::string, TimeNs>, double>;

/**
 * Compares a figure of two on the windows or runs that both have. Recordings are the clusters of the
 * bootstrap; runs of overlapping windows are its blocks. The names `a` and `b` are left empty.
 * @param figure kSuccessRate, or a key of windowMetrics(), whose unit the figures have
 * @param length_s of a window or run; infinity: it lasts to the end of the recording
 * @param sequences recordings, in the order in which they are drawn from and listed
 */
PairedComparison compareFigures(const std::string& figure, const FiguresByStart& a,
                                const FiguresByStart& b, double length_s,
                                const std::vector<std::string>& sequences,
                                const BootstrapOptions& options = {});

/** Says what the number of recordings means for the intervals; begins with a blank, or is empty. */
std::string sentenceOnRecordings(const std::vector<PairedComparison>& comparisons);

/**
 * Every figure of two initializers, for every shape and stage. An error enters where both give a
 * value; a refusal enters into the success of all windows that can be judged (judgedSuccess()).
 * Recordings are the clusters of the bootstrap; runs of overlapping windows are its blocks.
 * @param figures kSuccessRate or keys of windowMetrics(); others are refused with ConfigError
 */
std::vector<PairedComparison> comparePaired(const BenchmarkRecord& record, const std::string& a,
                                            const std::string& b,
                                            const std::vector<std::string>& figures,
                                            const BootstrapOptions& options = {});

/** kSuccessRate and all errors. */
std::vector<std::string> comparedFigures();

/**
 * A row a comparison.
 * @param group_in_title all are of the same two and the same window: these stand in the title, not
 * in columns
 */
TitledTable comparisonTable(const std::vector<PairedComparison>& comparisons,
                            const BootstrapOptions& options, bool group_in_title = false);

}  // namespace etalon
