#include "etalon/report/report.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <string>

#include "benchmark_side_tables.h"
#include "etalon/benchmark/summary.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_tables.h"
#include "report_assets.h"
#include "report_data.h"
#include "report_page.h"

namespace etalon {
namespace {

std::string sequenceText(const BenchmarkSequence& s, size_t attempts) {
  std::string text = "<b>" + escaped(s.name) + "</b> ";
  if (!s.error.empty())
    return text + "<span class=\"bad\">could not be used: " + escaped(s.error) + "</span>";
  text += counted(attempts, "attempt") + ", " + number(s.duration_s) + " s";
  if (!s.has_ground_truth) text += ", no ground truth";
  if (s.unreadable_images > 0) text += ", " + counted(s.unreadable_images, "unreadable image");
  for (const std::string& warning : s.warnings)
    text += "<br><span class=\"note\">" + escaped(warning) + "</span>";
  return text;
}

std::string sequencesText(const BenchmarkRecord& record) {
  std::map<std::string, size_t> counts;
  for (const WindowResult& result : record.results) ++counts[result.sequence];
  return joined(record.sequences, "<br>",
                [&](const BenchmarkSequence& s) { return sequenceText(s, counts[s.name]); });
}

std::string initializersText(const BenchmarkRecord& record) {
  return joined(record.initializers, "<br>", [](const BenchmarkInitializer& i) {
    std::string text = "<b>" + escaped(i.name) + "</b> " + escaped(i.version);
    if (!i.description.empty())
      text += " <span class=\"note\">" + escaped(i.description) + "</span>";
    return text;
  });
}

std::string shapesText(const BenchmarkRecord& record) {
  return joined(shapesOf(record), "; ", [](const WindowShape& shape) {
    std::string text = std::to_string(shape.keyframes) + " keyframes";
    if (shape.rate_hz > 0)
      text += " at " + number(shape.rate_hz) + " Hz (" +
              number((shape.keyframes - 1) / shape.rate_hz) + " s)";
    return text;
  });
}

std::string configText(const BenchmarkRecord& record) {
  std::string text = record.config;
  for (const BenchmarkInitializer& initializer : record.initializers)
    if (!initializer.config.empty()) text += "\n" + initializer.config;
  return escaped(text);
}

std::string tableText(const TitledTable& table, bool open) {
  const std::string note = noteOf(table);
  const std::string body = (note.empty() ? "" : "<p class=\"note\">" + escaped(note) + "</p>\n") +
                           "<div class=\"scroll\">" +
                           pageText(table.table.toString(TableFormat::kHtml)) + "</div>\n";
  const std::string title = escaped(table.title);
  if (open) return "<section class=\"table\"><h3>" + title + "</h3>\n" + body + "</section>\n";
  return "<details class=\"table\"><summary>" + title + "</summary>\n" + body + "</details>\n";
}

/** A closed group of tables; empty if there are none. */
std::string groupText(const std::string& title, const std::string& tables) {
  if (tables.empty()) return "";
  return "<details class=\"more\"><summary>" + title + "</summary>\n" + tables + "</details>\n";
}

/** The shape of the papers' windows where it is there, else the first. */
WindowShape mainShape(const BenchmarkRecord& record) {
  const std::vector<WindowShape> shapes = shapesOf(record);
  const WindowShape papers{10, 4.0};
  if (std::find(shapes.begin(), shapes.end(), papers) != shapes.end() || shapes.empty())
    return papers;
  return shapes.front();
}

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/** The tables to read first, of one shape; other shapes and the rest follow in closed groups. */
std::string tablesText(const BenchmarkRecord& record) {
  const std::string main_shape = shapeId(mainShape(record));
  std::string first, other_shapes, rest;
  for (const TitledTable& table : benchmarkTables(record)) {
    if (!table.headline)
      rest += tableText(table, false);
    else if (endsWith(table.id, main_shape) || !endsWith(table.id, "hz"))
      first += tableText(table, true);
    else
      other_shapes += tableText(table, true);
  }
  return first + groupText("The same for the other windows", other_shapes) +
         groupText("Every metric by mean, median and 90th percentile; parts of the run time", rest);
}

}  // namespace

std::string benchmarkReportHtml(const BenchmarkRecord& record) {
  nlohmann::json data = reportData(record);
  const BenchmarkProtocol& protocol = record.protocol;
  std::string tried = counted(record.results.size(), "attempt") + ", a window every " +
                      number(protocol.every_s) + " s; every window counts, refused or not";
  if (record.shards > 1)
    tried += "<br><span class=\"bad\">part " + std::to_string(record.shard) + " of " +
             std::to_string(record.shards) + ", not the whole benchmark</span>";
  const std::string summary =
      term("Sequences", sequencesText(record)) + term("Initializers", initializersText(record)) +
      term("Windows", shapesText(record)) + term("Attempts", tried) +
      term("Stages", protocol.vi_ba ? "initializer alone (init); after visual-inertial bundle "
                                      "adjustment and acceptance (vi_ba)"
                                    : "initializer alone (init)") +
      term("Versions", versionsText(record.versions));
  return reportPage(report_assets::benchmarkPage(), report_assets::benchmarkScript(),
                    {{"title", "Benchmark of initializers"},
                     {"summary", summary},
                     {"tables", tablesText(record)},
                     {"config", configText(record)}},
                    data);
}

}  // namespace etalon
