#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/benchmark/record.h"

namespace etalon {

/** SummaryRow::sequence of a row over all of them, every window with the same weight. */
constexpr const char* kAllSequences = "all";
/** Name of the success rate beside the keys of windowMetrics(). */
constexpr const char* kSuccessRate = "success";
/** SummaryRow::which. */
constexpr const char* kAllWindows = "all";
constexpr const char* kMovingWindows = "moving";

/** Statistics of one figure over windows; NaN where there is none. */
struct FigureSummary {
  int count = 0;  ///< windows that have the figure
  double mean = WindowErrors::kNone;
  double median = WindowErrors::kNone;
  double p90 = WindowErrors::kNone;  ///< 90th percentile; see quantile()
};

FigureSummary summaryOf(const std::vector<double>& values);

/** Results of an initializer and stage on the windows of one sequence (or of all) and one shape. */
struct SummaryRow {
  std::string sequence;  ///< or kAllSequences
  int keyframes = 0;
  double rate_hz = 0.0;
  std::string initializer;
  std::string stage;  ///< kStageInit or kStageViBa
  std::string which;  ///< kAllWindows, or kMovingWindows: those that inMotion()

  int count = 0;      ///< windows
  int judged = 0;     ///< windows whose success can be judged, refused ones included
  int unknown = 0;    ///< the others
  int estimates = 0;  ///< windows in which the stage gave an estimate
  int refusals = 0;   ///< windows in which it gave none
  int accepted = 0;   ///< init: those with an estimate; vi_ba: accepted as a start of the odometry
  int successes = 0;  ///< of those judged
  double success_rate = WindowErrors::kNone;  ///< successes / judged
  /** Judged windows whose estimate keeps the limits of a success in gravity and velocity, accepted
   * or not. In vi_ba the excess over `successes` is good estimates that the acceptance refused. */
  int good_estimates = 0;
  double good_estimate_rate = WindowErrors::kNone;  ///< good_estimates / judged
  int false_accepts = 0;                            ///< of those judged (WindowRow::falseAccept())
  FigureSummary window_s;                           ///< length of the windows that were accepted

  /** Over the windows with an estimate, in the order of windowMetrics(). */
  std::vector<FigureSummary> errors;
  /** The same in the order of neesMetrics(). */
  std::vector<FigureSummary> nees;
  FigureSummary runtime_ms;  ///< init: the initializer without stereo odometry; vi_ba: the VI-BA
  FigureSummary stereo_odometry_ms;  ///< stereo odometry, where it was asked for
};

/** Whether the ground truth's path over the window's keyframes is longer than kMinPathForScale;
 * false without ground truth. */
bool inMotion(const WindowResult& result);

/** The windows' shapes, in the record's order. */
std::vector<WindowShape> shapesOf(const BenchmarkRecord& record);
/** Names in the order of their first window. */
std::vector<std::string> sequencesOf(const BenchmarkRecord& record);
std::vector<std::string> initializersOf(const BenchmarkRecord& record);
/** kStageInit and, where the protocol has it, kStageViBa. */
std::vector<std::string> stagesOf(const BenchmarkRecord& record);

/**
 * Whether each of the record's windows succeeded in `stage`: status success, gravity < 2 deg and
 * velocity < 0.1 m/s; a refused window did not. Nothing where the ground truth does not allow
 * judging it (none at the first keyframe or at too few of them, or a recording without velocities),
 * refused or not: whether a window is judged does not depend on the initializer's result.
 */
std::vector<std::optional<bool>> judgedSuccess(const BenchmarkRecord& record,
                                               const std::string& stage);

/** The rows by shape, sequence (then all of them), initializer, stage, and all or moving windows,
 * nested in this order. */
std::vector<SummaryRow> summarize(const BenchmarkRecord& record);

/** Statistics of a figure of WindowResult::truth_check over the windows of a shape and sequence
 * (or kAllSequences), every window once. Nothing where windows grow: each initializer has its own. */
FigureSummary truthCheck(const BenchmarkRecord& record, const WindowShape& shape,
                         const std::string& sequence, double WindowTruthCheck::*figure);

/** The text of summary.csv (docs/evaluation.md): header, numbers as %.9g, empty where there is
 * none; run times in the last columns. */
std::string summaryCsv(const std::vector<SummaryRow>& rows);
std::string summaryCsv(const BenchmarkRecord& record);

}  // namespace etalon
