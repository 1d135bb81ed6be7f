#include <nlohmann/json.hpp>

#include "benchmark_side_tables.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_tables.h"

// The tables of a benchmark for programs: one JSON document, one CSV table.

namespace etalon {
namespace {

using Json = nlohmann::ordered_json;

Json numberOrNull(double value, bool known) { return known ? Json(value) : Json(); }

Json textOrNull(const std::string& text) { return text.empty() ? Json() : Json(text); }

/** A column with what its numbers belong to; `factor` leads to the unit of the titles. */
Json columnJson(const Table::Column& column) {
  Json json;
  json["key"] = column.key;
  json["title"] = column.title;
  json["group"] = textOrNull(column.group);
  const bool without = column.group == kWithout, with = column.group == kWith;
  json["initializer"] = without || with ? Json(column.title) : Json();
  json["stage"] = without ? Json(kStageInit) : with ? Json(kStageViBa) : Json();
  json["number"] = column.number;
  json["factor"] = column.factor;
  return json;
}

Json rowsOf(const TitledTable& table) {
  return Json::parse(table.table.toString(TableFormat::kJson));
}

Json tableJson(const TitledTable& table) {
  Json json;
  json["id"] = table.id;
  json["title"] = table.title;
  json["note"] = table.note;
  json["metric"] = textOrNull(table.metric);
  json["statistic"] = textOrNull(table.statistic);
  json["keyframes"] = table.keyframes > 0 ? Json(table.keyframes) : Json();
  json["rate_hz"] = numberOrNull(table.rate_hz, table.keyframes > 0);
  json["columns"] = Json::array();
  for (const Table::Column& column : table.table.columns())
    if (!column.people_only) json["columns"].push_back(columnJson(column));
  json["rows"] = rowsOf(table);
  return json;
}

std::string dumped(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/** What a number of the CSV table is of; empty where it is of all. */
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
                    line("refusals", "count", label, row.count, row.count - row.accepted);
  const std::vector<WindowMetric> metrics = windowMetrics();
  for (size_t m = 0; m < metrics.size(); ++m) csv += lines(metrics[m].key, label, row.errors[m]);
  const std::vector<WindowMetric> nees = neesMetrics();
  for (size_t m = 0; m < nees.size(); ++m) csv += lines(nees[m].key, label, row.nees[m]);
  return csv + lines("runtime_ms", label, row.runtime_ms) +
         lines("visual_odometry_ms", label, row.stereo_odometry_ms);
}

/** Lines of a table whose rows are of a sequence each: a metric a column of numbers. */
std::string linesOfColumns(const TitledTable& table, Label label) {
  std::string csv;
  for (const Json& row : rowsOf(table)) {
    label.sequence = row.at("sequence").get<std::string>();
    const int count = row.contains("slots") ? row.at("slots").get<int>() : -1;
    for (const Table::Column& column : table.table.columns())
      if (column.number && column.key != "slots" && !row.at(column.key).is_null())
        csv += line(table.metric + "_" + column.key, "", label, count,
                    row.at(column.key).get<double>());
  }
  return csv;
}

std::string linesOfParts(const TitledTable& table, Label label) {
  std::string csv;
  label.sequence = kAllSequences;
  for (const Json& row : rowsOf(table)) {
    label.initializer = row.at("initializer").get<std::string>();
    const std::string metric = "runtime_ms: " + row.at("part").get<std::string>();
    for (const char* statistic : {"mean", "median", "p90"})
      csv += line(metric, statistic, label, row.at("slots").get<int>(),
                  row.at(statistic + std::string("_ms")).get<double>());
  }
  return csv;
}

}  // namespace

std::string titledTableJson(const TitledTable& table) { return dumped(tableJson(table)); }

std::string benchmarkTablesJson(const BenchmarkRecord& record) {
  Json json = Json::array();
  for (const TitledTable& table : benchmarkTables(record)) json.push_back(tableJson(table));
  return dumped(json);
}

std::string benchmarkTablesCsv(const BenchmarkRecord& record) {
  std::string csv =
      "metric,statistic,keyframes,rate_hz,slots,sequence,initializer,stage,count,value\n";
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
  return csv + linesOfColumns(boundTable(record), {",", "", "", "", ""});
}

}  // namespace etalon
