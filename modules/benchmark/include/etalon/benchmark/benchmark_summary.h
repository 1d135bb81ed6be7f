#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/benchmark/benchmark_record.h"

namespace etalon {

/** SummaryRow::sequence of a row over all of them, every slot with the same weight. */
constexpr const char* kAllSequences = "all";
/** Name of the success rate beside the keys of segmentMetrics(). */
constexpr const char* kSuccessRate = "success";
/** SummaryRow::slots. */
constexpr const char* kAllSlots = "all";
constexpr const char* kMovingSlots = "moving";

/** Statistics of one figure over slots; NaN where there is none. */
struct FigureSummary {
  int count = 0;  ///< slots that have the figure
  double mean = SegmentErrors::kNone;
  double median = SegmentErrors::kNone;
  double p90 = SegmentErrors::kNone;  ///< 90th percentile; see quantile()
};

FigureSummary summaryOf(const std::vector<double>& values);

/** What one initializer and stage made of the slots of one sequence (or of all) and one window. */
struct SummaryRow {
  std::string sequence;  ///< or kAllSequences
  int keyframes = 0;
  double rate_hz = 0.0;
  std::string initializer;
  std::string stage;  ///< kStageInit or kStageViBa
  std::string slots;  ///< kAllSlots, or kMovingSlots: those that inMotion()

  int count = 0;      ///< slots
  int judged = 0;     ///< slots whose success can be judged, refused ones included
  int unknown = 0;    ///< the others
  int estimates = 0;  ///< slots in which the stage gave an estimate
  int refusals = 0;   ///< slots in which it gave none
  int accepted = 0;   ///< init: those with an estimate; vi_ba: accepted as a start of the odometry
  int successes = 0;  ///< of those judged
  double success_rate = SegmentErrors::kNone;  ///< successes / judged
  /** Of those judged, with an estimate whose gravity and velocity are as a success asks for,
   * accepted or not. More than `successes` in vi_ba: what the acceptance refused without need. */
  int good_estimates = 0;
  double good_estimate_rate = SegmentErrors::kNone;  ///< good_estimates / judged

  /** Over the slots with an estimate, in the order of segmentMetrics(). */
  std::vector<FigureSummary> errors;
  /** The same in the order of neesMetrics(). */
  std::vector<FigureSummary> nees;
  FigureSummary runtime_ms;          ///< init: the initializer without step 1; vi_ba: the VI-BA
  FigureSummary visual_odometry_ms;  ///< step 1, where it was asked for
};

/** Whether the ground truth's path over the window's keyframes is longer than kMinPathForScale;
 * false without ground truth. */
bool inMotion(const SlotRecord& slot);

/** Slots in the record's order by window: (keyframes, rate_hz). */
std::vector<std::pair<int, double>> windowsOf(const BenchmarkRecord& record);
/** Names in the order of their first slot. */
std::vector<std::string> sequencesOf(const BenchmarkRecord& record);
std::vector<std::string> initializersOf(const BenchmarkRecord& record);
/** kStageInit and, where the protocol has it, kStageViBa. */
std::vector<std::string> stagesOf(const BenchmarkRecord& record);

/**
 * Whether each of the record's slots succeeded in `stage`: status success, gravity < 2 deg and
 * velocity < 0.1 m/s; a refused slot did not. Nothing where the ground truth does not allow to
 * judge it (none at the first keyframe, or a recording without velocities), refused or not: whether
 * a slot is judged does not depend on what an initializer made of it.
 */
std::vector<std::optional<bool>> judgedSuccess(const BenchmarkRecord& record,
                                               const std::string& stage);

/** By window, sequence (then all of them), initializer, stage, and all or moving slots, nested in
 * this order. */
std::vector<SummaryRow> summarize(const BenchmarkRecord& record);

/** A floor of SlotRecord::gyro_floor over the slots of a window and sequence (or kAllSequences),
 * every slot once. */
FigureSummary gyroFloor(const BenchmarkRecord& record, const std::pair<int, double>& window,
                        const std::string& sequence, double GyroWindowFloor::*floor);

/** summary.csv (docs/evaluation.md): header, numbers as %.9g, empty where there is none; run times
 * in the last columns. */
std::string summaryCsv(const std::vector<SummaryRow>& rows);
std::string summaryCsv(const BenchmarkRecord& record);

}  // namespace etalon
