#include "etalon/benchmark/record.h"

#include "etalon/core/text.h"
#include "etalon/evaluation/window_metrics.h"

namespace etalon {

double WindowResult::seconds() const {
  return attempt.keyframes.empty() ? WindowErrors::kNone : secondsBetween(t0, attempt.t);
}

std::optional<bool> WindowRow::success() const {
  if (status != kStatusSuccess) return false;
  return errors.success();
}

std::optional<bool> WindowRow::falseAccept() const {
  const std::optional<std::string> why = falseAcceptReason();
  if (!why) return std::nullopt;
  return !why->empty();
}

std::optional<std::string> WindowRow::falseAcceptReason() const {
  if (status != kStatusSuccess) return "";
  const std::optional<bool> good = errors.success();
  if (!good) return std::nullopt;
  std::vector<std::string> reasons = errors.outsideClaim();
  if (!*good) reasons.insert(reasons.begin(), "no success");
  return joined(reasons);
}

WindowRow windowRow(const WindowResult& result, const std::string& stage) {
  WindowRow row;
  row.sequence = result.sequence;
  row.window = result.window;
  row.t0 = result.t0;
  row.keyframes = result.keyframes;
  row.rate_hz = result.rate_hz;
  row.initializer = result.initializer;
  row.stage = stage;
  const StageRecord* reached = result.attempt.stage(stage);
  const bool gave_estimate = stage == kStageInit && reached != nullptr;
  row.status = gave_estimate ? kStatusSuccess : result.attempt.status;
  row.reason = gave_estimate ? "" : result.attempt.reason;
  if (reached && reached->errors) row.errors = *reached->errors;
  row.window_s = result.seconds();
  row.runtime_ms =
      result.attempt.milliseconds(stage == kStageInit ? kTimingInitialize : kTimingViBa);
  return row;
}

std::vector<WindowRow> windowRows(const BenchmarkRecord& record) {
  std::vector<WindowRow> rows;
  for (const WindowResult& result : record.results) {
    rows.push_back(windowRow(result, kStageInit));
    if (record.protocol.vi_ba) rows.push_back(windowRow(result, kStageViBa));
  }
  return rows;
}

std::string windowsCsv(const std::vector<WindowRow>& rows) {
  std::string csv =
      "sequence,window,t0_ns,keyframes,rate_hz,initializer,stage,status,reason,rre_deg,ate_m,"
      "gravity_deg,velocity_mps,gyro_bias_rps,accel_bias_mps2,scale_error";
  for (const WindowMetric& metric : neesMetrics()) csv += "," + metric.key;
  csv += ",window_s,runtime_ms\n";
  for (const WindowRow& row : rows) {
    const WindowErrors& e = row.errors;
    csv += csvField(row.sequence) + "," + std::to_string(row.window) + "," +
           std::to_string(row.t0) + "," + std::to_string(row.keyframes) + "," +
           csvNumber(row.rate_hz) + "," + csvField(row.initializer) + "," + row.stage + "," +
           row.status + "," + csvField(row.reason);
    for (const double value : {e.rre_deg, e.ate_m, e.gravity_deg, e.velocity_mps, e.gyro_bias_rps,
                               e.accel_bias_mps2, e.scale_error})
      csv += "," + csvNumber(value);
    for (const WindowMetric& metric : neesMetrics()) csv += "," + csvNumber(e.*metric.error);
    csv += "," + csvNumber(row.window_s) + "," + csvNumber(row.runtime_ms) + "\n";
  }
  return csv;
}

}  // namespace etalon
