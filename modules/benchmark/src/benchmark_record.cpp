#include "etalon/benchmark/benchmark_record.h"

#include "etalon/core/text.h"
#include "etalon/evaluation/segment_metrics.h"

namespace etalon {
std::optional<bool> SegmentRow::success() const {
  if (status != kStatusSuccess) return false;
  return errors.success();
}

SegmentRow segmentRow(const SlotRecord& slot, const std::string& stage) {
  SegmentRow row;
  row.sequence = slot.sequence;
  row.segment = slot.segment;
  row.t0 = slot.t0;
  row.keyframes = slot.keyframes;
  row.rate_hz = slot.rate_hz;
  row.initializer = slot.initializer;
  row.stage = stage;
  const StageRecord* reached = slot.attempt.stage(stage);
  const bool gave_estimate = stage == kStageInit && reached != nullptr;
  row.status = gave_estimate ? kStatusSuccess : slot.attempt.status;
  row.reason = gave_estimate ? "" : slot.attempt.reason;
  if (reached && reached->errors) row.errors = *reached->errors;
  row.runtime_ms = slot.attempt.milliseconds(stage == kStageInit ? kTimingInitialize : kTimingViBa);
  return row;
}

std::vector<SegmentRow> segmentRows(const BenchmarkRecord& record) {
  std::vector<SegmentRow> rows;
  for (const SlotRecord& slot : record.slots) {
    rows.push_back(segmentRow(slot, kStageInit));
    if (record.protocol.vi_ba) rows.push_back(segmentRow(slot, kStageViBa));
  }
  return rows;
}

std::string segmentsCsv(const std::vector<SegmentRow>& rows) {
  std::string csv =
      "sequence,segment,t0_ns,keyframes,rate_hz,initializer,stage,status,reason,rre_deg,ate_m,"
      "gravity_deg,velocity_mps,gyro_bias_rps,accel_bias_mps2,scale_error";
  for (const SegmentMetric& metric : neesMetrics()) csv += "," + metric.key;
  csv += ",runtime_ms\n";
  for (const SegmentRow& row : rows) {
    const SegmentErrors& e = row.errors;
    csv += csvField(row.sequence) + "," + std::to_string(row.segment) + "," +
           std::to_string(row.t0) + "," + std::to_string(row.keyframes) + "," +
           csvNumber(row.rate_hz) + "," + csvField(row.initializer) + "," + row.stage + "," +
           row.status + "," + csvField(row.reason);
    for (const double value : {e.rre_deg, e.ate_m, e.gravity_deg, e.velocity_mps, e.gyro_bias_rps,
                               e.accel_bias_mps2, e.scale_error})
      csv += "," + csvNumber(value);
    for (const SegmentMetric& metric : neesMetrics()) csv += "," + csvNumber(e.*metric.error);
    csv += "," + csvNumber(row.runtime_ms) + "\n";
  }
  return csv;
}

}  // namespace etalon
