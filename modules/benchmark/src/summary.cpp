#include "etalon/benchmark/summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/window_metrics.h"

namespace etalon {
namespace {

template <typename Value, typename Of>
std::vector<Value> distinct(const BenchmarkRecord& record, Of of) {
  std::vector<Value> values;
  for (const WindowResult& result : record.results)
    if (std::find(values.begin(), values.end(), of(result)) == values.end())
      values.push_back(of(result));
  return values;
}

/** Recordings whose ground truth has velocities: one is not zero, or a velocity error is known. */
std::set<std::string> sequencesWithVelocities(const BenchmarkRecord& record) {
  std::set<std::string> names;
  for (const WindowResult& result : record.results) {
    for (const StampedState& truth : result.truth)
      if (!truth.v_WB.isZero(0.0)) names.insert(result.sequence);
    for (const StageRecord& stage : result.attempt.stages)
      if (stage.errors && !std::isnan(stage.errors->velocity_mps)) names.insert(result.sequence);
  }
  return names;
}

/** Statistics of the windows with an estimate, in the order of `metrics`. */
std::vector<FigureSummary> summaries(const std::vector<WindowErrors>& estimates,
                                     const std::vector<WindowMetric>& metrics) {
  std::vector<FigureSummary> summaries;
  for (const WindowMetric& metric : metrics) {
    std::vector<double> values;
    for (const WindowErrors& errors : estimates) values.push_back(errors.*metric.error);
    summaries.push_back(summaryOf(values));
  }
  return summaries;
}

/** A window of a summary and whether it succeeded. */
struct Judged {
  const WindowResult* result;
  std::optional<bool> success;
};

SummaryRow summarizeResults(const std::vector<Judged>& results, const std::string& stage) {
  SummaryRow row;
  row.stage = stage;
  std::vector<WindowErrors> estimates;
  std::vector<double> runtime, stereo_odometry, seconds;
  for (const auto& [result, success] : results) {
    const WindowRow window = windowRow(*result, stage);
    const bool estimate = result->attempt.stage(stage) != nullptr;
    ++row.count;
    ++(estimate ? row.estimates : row.refusals);
    ++(success ? row.judged : row.unknown);
    if (window.status == kStatusSuccess) {
      ++row.accepted;
      seconds.push_back(window.window_s);
    }
    if (success && window.falseAccept().value_or(false)) ++row.false_accepts;
    if (success.value_or(false)) ++row.successes;
    if (success && estimate && window.errors.success().value_or(false)) ++row.good_estimates;
    if (estimate) estimates.push_back(window.errors);
    runtime.push_back(window.runtime_ms);
    stereo_odometry.push_back(result->attempt.milliseconds(kTimingStereoOdometry));
  }
  if (row.judged > 0) {
    row.success_rate = static_cast<double>(row.successes) / row.judged;
    row.good_estimate_rate = static_cast<double>(row.good_estimates) / row.judged;
  }
  row.errors = summaries(estimates, windowMetrics());
  row.nees = summaries(estimates, neesMetrics());
  row.window_s = summaryOf(seconds);
  row.runtime_ms = summaryOf(runtime);
  row.stereo_odometry_ms = summaryOf(stereo_odometry);
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
  summary.count = known.size();
  if (known.empty()) return summary;
  summary.mean =
      std::accumulate(known.begin(), known.end(), 0.0) / static_cast<double>(known.size());
  summary.median = quantile(known, 0.5);
  summary.p90 = quantile(std::move(known), 0.9);
  return summary;
}

bool inMotion(const WindowResult& result) {
  std::vector<Eigen::Vector3d> points;
  for (const StampedState& truth : result.truth) points.push_back(truth.T_WB.t);
  return pathLength(points) > kMinPathForScale;
}

std::vector<WindowShape> shapesOf(const BenchmarkRecord& record) {
  return distinct<WindowShape>(record, [](const WindowResult& result) { return result.shape(); });
}

std::vector<std::string> sequencesOf(const BenchmarkRecord& record) {
  return distinct<std::string>(record, [](const WindowResult& result) { return result.sequence; });
}

std::vector<std::string> initializersOf(const BenchmarkRecord& record) {
  return distinct<std::string>(record,
                               [](const WindowResult& result) { return result.initializer; });
}

std::vector<std::string> stagesOf(const BenchmarkRecord& record) {
  if (record.protocol.vi_ba) return {kStageInit, kStageViBa};
  return {kStageInit};
}

std::vector<std::optional<bool>> judgedSuccess(const BenchmarkRecord& record,
                                               const std::string& stage) {
  const std::set<std::string> with_velocities = sequencesWithVelocities(record);
  std::vector<std::optional<bool>> successes;
  for (const WindowResult& result : record.results) {
    const bool can_be_judged = with_velocities.count(result.sequence) > 0 &&
                               coversEnough(result, record.protocol) &&
                               result.truth.front().t == result.t0;
    successes.push_back(can_be_judged ? windowRow(result, stage).success() : std::nullopt);
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
    std::vector<Judged> results;
    for (size_t i = 0; i < record.results.size(); ++i) {
      const WindowResult& result = record.results[i];
      if (result.keyframes == key.keyframes && result.rate_hz == key.rate_hz &&
          result.initializer == key.initializer &&
          (key.sequence == kAllSequences || result.sequence == key.sequence) &&
          (key.which == kAllWindows || inMotion(result)))
        results.push_back({&result, success[i]});
    }
    SummaryRow row = summarizeResults(results, key.stage);
    row.sequence = key.sequence;
    row.keyframes = key.keyframes;
    row.rate_hz = key.rate_hz;
    row.initializer = key.initializer;
    row.which = key.which;
    rows.push_back(std::move(row));
  };
  SummaryRow key;
  for (const auto& [keyframes, rate_hz] : shapesOf(record)) {
    key.keyframes = keyframes;
    key.rate_hz = rate_hz;
    for (const std::string& sequence : sequences)
      for (const std::string& initializer : initializers)
        for (size_t s = 0; s < successes.size(); ++s)
          for (const char* which : {kAllWindows, kMovingWindows}) {
            key.sequence = sequence;
            key.initializer = initializer;
            key.stage = stagesOf(record)[s];
            key.which = which;
            add(key, successes[s]);
          }
  }
  return rows;
}

FigureSummary truthCheck(const BenchmarkRecord& record, const WindowShape& shape,
                         const std::string& sequence, double WindowTruthCheck::*figure) {
  if (record.protocol.min_keyframes > 0) return {};
  std::map<std::pair<std::string, int>, double> by_window;
  for (const WindowResult& result : record.results)
    if (result.shape() == shape && (sequence == kAllSequences || result.sequence == sequence))
      by_window[{result.sequence, result.window}] = result.truth_check.*figure;
  std::vector<double> values;
  for (const auto& [result, value] : by_window) values.push_back(value);
  return summaryOf(values);
}

std::string summaryCsv(const std::vector<SummaryRow>& rows) {
  std::string csv =
      "sequence,keyframes,rate_hz,initializer,stage,windows,count,judged,unknown,estimates,"
      "refusals,"
      "accepted,successes,success_rate";
  for (const WindowMetric& metric : windowMetrics()) csv += figureNames(metric.key);
  csv += ",good_estimates,good_estimate_rate";
  for (const WindowMetric& metric : neesMetrics()) csv += figureNames(metric.key);
  csv += ",false_accepts" + figureNames("window_s") + figureNames("runtime_ms") +
         figureNames("stereo_odometry_ms") + "\n";
  for (const SummaryRow& row : rows) {
    csv += csvField(row.sequence) + "," + std::to_string(row.keyframes) + "," +
           csvNumber(row.rate_hz) + "," + csvField(row.initializer) + "," + row.stage + "," +
           row.which;
    for (const int count : {row.count, row.judged, row.unknown, row.estimates, row.refusals,
                            row.accepted, row.successes})
      csv += "," + std::to_string(count);
    csv += "," + csvNumber(row.success_rate);
    for (const FigureSummary& error : row.errors) csv += figures(error);
    csv += "," + std::to_string(row.good_estimates) + "," + csvNumber(row.good_estimate_rate);
    for (const FigureSummary& nees : row.nees) csv += figures(nees);
    csv += "," + std::to_string(row.false_accepts) + figures(row.window_s) +
           figures(row.runtime_ms) + figures(row.stereo_odometry_ms) + "\n";
  }
  return csv;
}

std::string summaryCsv(const BenchmarkRecord& record) { return summaryCsv(summarize(record)); }

}  // namespace etalon
