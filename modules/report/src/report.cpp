#include "etalon/report/report.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <string>

#include "benchmark_side_tables.h"
#include "etalon/benchmark/summary.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_tables.h"
#include "etalon/report/comparison_table.h"
#include "report_assets.h"
#include "report_data.h"
#include "run_as_benchmark.h"

namespace etalon {
namespace {

std::string escaped(const std::string& text) { return htmlText(pageText(text)); }

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string counted(size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/** `page` with each {{name}} replaced once; a text that is put in is not searched again. */
std::string filled(std::string_view page, const std::map<std::string, std::string>& texts) {
  size_t size = page.size();
  for (const auto& [name, text] : texts) size += text.size();
  std::string result;
  result.reserve(size);
  for (size_t begin = 0; begin < page.size();) {
    const size_t open = page.find("{{", begin);
    const size_t close = page.find("}}", std::min(open, page.size()));
    if (close == std::string_view::npos) {
      result += page.substr(begin);
      break;
    }
    result += page.substr(begin, open - begin);
    const auto text = texts.find(std::string(page.substr(open + 2, close - open - 2)));
    if (text != texts.end()) result += text->second;
    begin = close + 2;
  }
  return result;
}

/** A term of the summary's list; nothing without content. `html` is escaped already. */
std::string term(const std::string& name, const std::string& html) {
  return html.empty() ? "" : "<dt>" + name + "</dt><dd>" + html + "</dd>\n";
}

template <typename Items, typename Text>
std::string joined(const Items& items, const std::string& separator, const Text& textOf) {
  std::string result;
  for (const auto& item : items) result += (result.empty() ? "" : separator) + textOf(item);
  return result;
}

std::string sequenceText(const BenchmarkSequence& s, size_t attempts, const std::string& noun) {
  std::string text = "<b>" + escaped(s.name) + "</b> ";
  if (!s.error.empty())
    return text + "<span class=\"bad\">could not be used: " + escaped(s.error) + "</span>";
  text += counted(attempts, noun) + ", " + number(s.duration_s) + " s";
  if (!s.has_ground_truth) text += ", no ground truth";
  if (s.unreadable_images > 0) text += ", " + counted(s.unreadable_images, "unreadable image");
  for (const std::string& warning : s.warnings)
    text += "<br><span class=\"note\">" + escaped(warning) + "</span>";
  return text;
}

std::string sequencesText(const BenchmarkRecord& record, const std::string& noun) {
  std::map<std::string, size_t> counts;
  for (const WindowResult& result : record.results) ++counts[result.sequence];
  return joined(record.sequences, "<br>",
                [&](const BenchmarkSequence& s) { return sequenceText(s, counts[s.name], noun); });
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

std::string versionsText(const std::map<std::string, std::string>& versions) {
  return joined(versions, ", ", [](const auto& v) { return escaped(v.first + " " + v.second); });
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

/** A closed group of tables; nothing without one. */
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

/** Those to read first, of one shape; closed behind them those of other shapes, and the rest. */
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

std::string page(const std::string& title, const std::string& summary, const std::string& tables,
                 const BenchmarkRecord& record, const nlohmann::json& data) {
  return filled(report_assets::page(),
                {{"title", escaped(title)},
                 {"summary", summary},
                 {"tables", tables},
                 {"config", configText(record)},
                 {"data", scriptText(data)},
                 {"style", std::string(report_assets::style())},
                 {"script", std::string(report_assets::script())},
                 {"library", std::string(report_assets::library())},
                 {"licences", escaped(std::string(report_assets::licences()))}});
}

}  // namespace

std::string benchmarkReportHtml(const BenchmarkRecord& record) {
  nlohmann::json data = reportData(record);
  data["kind"] = "benchmark";
  const BenchmarkProtocol& protocol = record.protocol;
  std::string tried = counted(record.results.size(), "attempt") + ", a window every " +
                      number(protocol.every_s) + " s; every window counts, refused or not";
  if (record.shards > 1)
    tried += "<br><span class=\"bad\">part " + std::to_string(record.shard) + " of " +
             std::to_string(record.shards) + ", not the whole benchmark</span>";
  const std::string summary =
      term("Sequences", sequencesText(record, "attempt")) +
      term("Initializers", initializersText(record)) + term("Windows", shapesText(record)) +
      term("Attempts", tried) +
      term("Stages", protocol.vi_ba ? "initializer alone (init); after visual-inertial bundle "
                                      "adjustment and acceptance (vi_ba)"
                                    : "initializer alone (init)") +
      term("Versions", versionsText(record.versions));
  return page("Benchmark of initializers", summary, tablesText(record), record, data);
}

std::string runReportHtml(const RunRecord& record, const Trajectory& odometry,
                          const GroundTruth& ground_truth) {
  const BenchmarkRecord benchmark = benchmarkOfRun(record, ground_truth);
  nlohmann::json data = reportData(benchmark);
  data["kind"] = "run";
  data["trajectory"] = trajectoryData(odometry, ground_truth, record.first_image);
  data["initialized_at_s"] = nullptr;
  std::string started = "never";
  if (record.initialized_at) {
    const double at_s = secondsBetween(record.first_image, *record.initialized_at);
    data["initialized_at_s"] = at_s;
    started = number(at_s) + " s after the first image";
  }
  const BenchmarkSequence& sequence = benchmark.sequences.front();
  const std::string summary = term("Recording", sequencesText(benchmark, "attempt")) +
                              term("Source", escaped(record.source)) +
                              term("Initializer", initializersText(benchmark)) +
                              term("Window", shapesText(benchmark)) + term("Initialised", started) +
                              term("Versions", versionsText(record.versions));
  const std::vector<std::pair<std::string, RunRecord>> runs = {{sequence.name, record}};
  const std::string table =
      "<section class=\"table\"><h3>The attempt that counts</h3>\n<div "
      "class=\"scroll\">" +
      pageText(compareRuns(runs).toString(TableFormat::kHtml)) + "</div></section>\n";
  const std::string refusals = joined(refusalsOf(runs), "", [](const std::string& sentence) {
    return "<p class=\"bad\">" + escaped(sentence) + "</p>\n";
  });
  return page(sequence.name + ", " + record.initializer, summary, refusals + table, benchmark,
              data);
}

}  // namespace etalon
