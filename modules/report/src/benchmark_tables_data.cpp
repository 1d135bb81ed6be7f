#include <cmath>

#include "benchmark_side_tables.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_tables.h"

// The tables of a benchmark for programs: one CSV table.

namespace etalon {
namespace {

/** The labels of a number in the CSV table; an empty one means all. */
struct Label {
  std::string shape;  ///< keyframes,rate_hz
  std::string which, sequence, initializer, stage;
};

std::string shapeFields(int keyframes, double rate_hz) {
  return std::to_string(keyframes) + "," + csvNumber(rate_hz);
}

std::string line(const std::string& metric, const std::string& statistic, const Label& label,
                 int count, double value) {
  return csvField(metric) + "," + statistic + "," + label.shape + "," + label.which + "," +
         csvField(label.sequence) + "," + csvField(label.initializer) + "," + label.stage + "," +
         (count >= 0 ? std::to_string(count) : "") + "," + csvNumber(value) + "\n";
}

std::string lines(const std::string& metric, const Label& label, const FigureSummary& figure) {
  return line(metric, "mean", label, figure.count, figure.mean) +
         line(metric, "median", label, figure.count, figure.median) +
         line(metric, "p90", label, figure.count, figure.p90);
}

std::string lines(const SummaryRow& row) {
  const Label label = {shapeFields(row.keyframes, row.rate_hz), row.which, row.sequence,
                       row.initializer, row.stage};
  std::string csv = line(kSuccessRate, "rate", label, row.judged, row.success_rate) +
                    line("good_estimates", "rate", label, row.judged, row.good_estimate_rate) +
                    line("refusals", "count", label, row.count, row.count - row.accepted) +
                    line("false_accepts", "count", label, row.judged, row.false_accepts);
  const std::vector<WindowMetric> metrics = windowMetrics();
  for (size_t m = 0; m < metrics.size(); ++m) csv += lines(metrics[m].key, label, row.errors[m]);
  const std::vector<WindowMetric> nees = neesMetrics();
  for (size_t m = 0; m < nees.size(); ++m) csv += lines(nees[m].key, label, row.nees[m]);
  return csv + lines("window_s", label, row.window_s) + lines("runtime_ms", label, row.runtime_ms) +
         lines("stereo_odometry_ms", label, row.stereo_odometry_ms);
}

/** Lines of a table with a row for each sequence and a column for each metric. */
std::string linesOfColumns(const TitledTable& titled, Label label) {
  const Table& table = titled.table;
  std::string csv;
  for (size_t row = 0; row < table.rowCount(); ++row) {
    label.sequence = table.textAt(row, "sequence");
    const int count =
        table.hasColumn("windows") ? static_cast<int>(table.numberAt(row, "windows")) : -1;
    for (const Table::Column& column : table.columns()) {
      if (!column.number || column.key == "windows") continue;
      const double value = table.numberAt(row, column.key);
      if (!std::isnan(value))
        csv += line(titled.metric + "_" + column.key, "", label, count, value);
    }
  }
  return csv;
}

std::string linesOfParts(const TitledTable& titled, Label label) {
  const Table& table = titled.table;
  std::string csv;
  label.sequence = kAllSequences;
  for (size_t row = 0; row < table.rowCount(); ++row) {
    label.initializer = table.textAt(row, "initializer");
    const std::string metric = "runtime_ms: " + table.textAt(row, "part");
    for (const char* statistic : {"mean", "median", "p90"})
      csv += line(metric, statistic, label, static_cast<int>(table.numberAt(row, "windows")),
                  table.numberAt(row, statistic + std::string("_ms")));
  }
  return csv;
}

}  // namespace

std::string benchmarkTablesCsv(const BenchmarkRecord& record) {
  std::string csv =
      "metric,statistic,keyframes,rate_hz,windows,sequence,initializer,stage,count,value\n";
  for (const SummaryRow& row : summarize(record)) csv += lines(row);
  for (const WindowShape& shape : shapesOf(record)) {
    const Label label = {shapeFields(shape.keyframes, shape.rate_hz), kAllWindows, "", "", ""};
    csv += linesOfParts(runtimePartsTable(record, shape), label);
    if (const std::optional<TitledTable> noise = noiseTable(record, shape)) {
      Label after_vi_ba = label;
      after_vi_ba.stage = kStageViBa;
      after_vi_ba.initializer = checkedInitializer(record, shape);
      csv += linesOfColumns(*noise, after_vi_ba);
    }
  }
  return csv + linesOfColumns(groundTruthTable(record), {",", "", "", "", ""});
}

}  // namespace etalon
