#include "etalon/benchmark/benchmark_summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/segment_metrics.h"

namespace etalon {
namespace {

template <typename Value, typename Of>
std::vector<Value> distinct(const BenchmarkRecord& record, Of of) {
  std::vector<Value> values;
  for (const SlotRecord& slot : record.slots)
    if (std::find(values.begin(), values.end(), of(slot)) == values.end())
      values.push_back(of(slot));
  return values;
}

/** Recordings whose ground truth has velocities: one of them is not zero, or an estimate's was
 * compared. */
std::set<std::string> sequencesWithVelocities(const BenchmarkRecord& record) {
  std::set<std::string> names;
  for (const SlotRecord& slot : record.slots) {
    for (const GroundTruthState& truth : slot.truth)
      if (!truth.v_WB.isZero(0.0)) names.insert(slot.sequence);
    for (const StageRecord& stage : slot.attempt.stages)
      if (stage.errors && !std::isnan(stage.errors->velocity_mps)) names.insert(slot.sequence);
  }
  return names;
}

/** Of the slots with an estimate, in the order of `metrics`. */
std::vector<FigureSummary> summaries(const std::vector<SegmentErrors>& estimates,
                                     const std::vector<SegmentMetric>& metrics) {
  std::vector<FigureSummary> summaries;
  for (const SegmentMetric& metric : metrics) {
    std::vector<double> values;
    for (const SegmentErrors& errors : estimates) values.push_back(errors.*metric.error);
    summaries.push_back(summaryOf(values));
  }
  return summaries;
}

/** A slot of a summary and whether it succeeded. */
struct Judged {
  const SlotRecord* slot;
  std::optional<bool> success;
};

SummaryRow summarizeSlots(const std::vector<Judged>& slots, const std::string& stage) {
  SummaryRow row;
  row.stage = stage;
  std::vector<SegmentErrors> estimates;
  std::vector<double> runtime, visual_odometry;
  for (const auto& [slot, success] : slots) {
    const SegmentRow segment = segmentRow(*slot, stage);
    const bool estimate = slot->attempt.stage(stage) != nullptr;
    ++row.count;
    ++(estimate ? row.estimates : row.refusals);
    ++(success ? row.judged : row.unknown);
    if (segment.status == kStatusSuccess) ++row.accepted;
    if (success.value_or(false)) ++row.successes;
    if (success && estimate && segment.errors.success().value_or(false)) ++row.good_estimates;
    if (estimate) estimates.push_back(segment.errors);
    runtime.push_back(segment.runtime_ms);
    visual_odometry.push_back(slot->attempt.milliseconds(kTimingVisualOdometry));
  }
  if (row.judged > 0) {
    row.success_rate = static_cast<double>(row.successes) / row.judged;
    row.good_estimate_rate = static_cast<double>(row.good_estimates) / row.judged;
  }
  row.errors = summaries(estimates, segmentMetrics());
  row.nees = summaries(estimates, neesMetrics());
  row.runtime_ms = summaryOf(runtime);
  row.visual_odometry_ms = summaryOf(visual_odometry);
  return row;
}

std::string figures(const FigureSummary& summary) {
  return "," + csvNumber(summary.mean) + "," + csvNumber(summary.median) + "," +
         csvNumber(summary.p90);
}

std::string figureNames(const std::string& key) {
  return "," + key + "_mean," + key + "_median," + key + "_p90";
}

}  // namespace

FigureSummary summaryOf(const std::vector<double>& values) {
  std::vector<double> known;
  std::copy_if(values.begin(), values.end(), std::back_inserter(known),
               [](double v) { return !std::isnan(v); });
  FigureSummary summary;
  summary.count = static_cast<int>(known.size());
  if (known.empty()) return summary;
  summary.mean =
      std::accumulate(known.begin(), known.end(), 0.0) / static_cast<double>(known.size());
  summary.median = quantile(known, 0.5);
  summary.p90 = quantile(std::move(known), 0.9);
  return summary;
}

bool inMotion(const SlotRecord& slot) {
  std::vector<Eigen::Vector3d> points;
  for (const GroundTruthState& truth : slot.truth) points.push_back(truth.T_WB.t);
  return pathLength(points) > kMinPathForScale;
}

std::vector<std::pair<int, double>> windowsOf(const BenchmarkRecord& record) {
  return distinct<std::pair<int, double>>(
      record, [](const SlotRecord& slot) { return std::make_pair(slot.keyframes, slot.rate_hz); });
}

std::vector<std::string> sequencesOf(const BenchmarkRecord& record) {
  return distinct<std::string>(record, [](const SlotRecord& slot) { return slot.sequence; });
}

std::vector<std::string> initializersOf(const BenchmarkRecord& record) {
  return distinct<std::string>(record, [](const SlotRecord& slot) { return slot.initializer; });
}

std::vector<std::string> stagesOf(const BenchmarkRecord& record) {
  if (record.protocol.vi_ba) return {kStageInit, kStageViBa};
  return {kStageInit};
}

std::vector<std::optional<bool>> judgedSuccess(const BenchmarkRecord& record,
                                               const std::string& stage) {
  const std::set<std::string> with_velocities = sequencesWithVelocities(record);
  std::vector<std::optional<bool>> successes;
  for (const SlotRecord& slot : record.slots) {
    const bool can_be_judged = with_velocities.count(slot.sequence) > 0 && !slot.truth.empty() &&
                               slot.truth.front().t == slot.t0;
    successes.push_back(can_be_judged ? segmentRow(slot, stage).success() : std::nullopt);
  }
  return successes;
}

std::vector<SummaryRow> summarize(const BenchmarkRecord& record) {
  std::vector<std::string> sequences = sequencesOf(record);
  sequences.emplace_back(kAllSequences);
  const std::vector<std::string> initializers = initializersOf(record);
  std::vector<SummaryRow> rows;
  std::vector<std::vector<std::optional<bool>>> successes;
  for (const std::string& stage : stagesOf(record))
    successes.push_back(judgedSuccess(record, stage));

  const auto add = [&](const SummaryRow& key, const std::vector<std::optional<bool>>& success) {
    std::vector<Judged> slots;
    for (size_t i = 0; i < record.slots.size(); ++i) {
      const SlotRecord& slot = record.slots[i];
      if (slot.keyframes == key.keyframes && slot.rate_hz == key.rate_hz &&
          slot.initializer == key.initializer &&
          (key.sequence == kAllSequences || slot.sequence == key.sequence) &&
          (key.slots == kAllSlots || inMotion(slot)))
        slots.push_back({&slot, success[i]});
    }
    SummaryRow row = summarizeSlots(slots, key.stage);
    row.sequence = key.sequence;
    row.keyframes = key.keyframes;
    row.rate_hz = key.rate_hz;
    row.initializer = key.initializer;
    row.slots = key.slots;
    rows.push_back(std::move(row));
  };
  SummaryRow key;
  for (const auto& [keyframes, rate_hz] : windowsOf(record)) {
    key.keyframes = keyframes;
    key.rate_hz = rate_hz;
    for (const std::string& sequence : sequences)
      for (const std::string& initializer : initializers)
        for (size_t s = 0; s < successes.size(); ++s)
          for (const char* slots : {kAllSlots, kMovingSlots}) {
            key.sequence = sequence;
            key.initializer = initializer;
            key.stage = stagesOf(record)[s];
            key.slots = slots;
            add(key, successes[s]);
          }
  }
  return rows;
}

FigureSummary gyroFloor(const BenchmarkRecord& record, const std::pair<int, double>& window,
                        const std::string& sequence, double GyroWindowFloor::*floor) {
  std::map<std::pair<std::string, int>, double> by_slot;
  for (const SlotRecord& slot : record.slots)
    if (std::make_pair(slot.keyframes, slot.rate_hz) == window &&
        (sequence == kAllSequences || slot.sequence == sequence))
      by_slot[{slot.sequence, slot.segment}] = slot.gyro_floor.*floor;
  std::vector<double> values;
  for (const auto& [slot, value] : by_slot) values.push_back(value);
  return summaryOf(values);
}

std::string summaryCsv(const std::vector<SummaryRow>& rows) {
  std::string csv =
      "sequence,keyframes,rate_hz,initializer,stage,slots,count,judged,unknown,estimates,refusals,"
      "accepted,successes,success_rate";
  for (const SegmentMetric& metric : segmentMetrics()) csv += figureNames(metric.key);
  csv += ",good_estimates,good_estimate_rate";
  for (const SegmentMetric& metric : neesMetrics()) csv += figureNames(metric.key);
  csv += figureNames("runtime_ms") + figureNames("visual_odometry_ms") + "\n";
  for (const SummaryRow& row : rows) {
    csv += csvField(row.sequence) + "," + std::to_string(row.keyframes) + "," +
           csvNumber(row.rate_hz) + "," + csvField(row.initializer) + "," + row.stage + "," +
           row.slots;
    for (const int count : {row.count, row.judged, row.unknown, row.estimates, row.refusals,
                            row.accepted, row.successes})
      csv += "," + std::to_string(count);
    csv += "," + csvNumber(row.success_rate);
    for (const FigureSummary& error : row.errors) csv += figures(error);
    csv += "," + std::to_string(row.good_estimates) + "," + csvNumber(row.good_estimate_rate);
    for (const FigureSummary& nees : row.nees) csv += figures(nees);
    csv += figures(row.runtime_ms) + figures(row.visual_odometry_ms) + "\n";
  }
  return csv;
}

std::string summaryCsv(const BenchmarkRecord& record) { return summaryCsv(summarize(record)); }

}  // namespace etalon
