#include "etalon/evaluation/comparison_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

std::string formatted(const char* format, int precision, double value) {
  char text[352];  // "%.*f" of the largest double has 309 digits before the point
  std::snprintf(text, sizeof text, format, precision, value);
  return text;
}

std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/** A bar would end a Markdown cell. */
std::string markdownField(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

/** Characters of UTF-8 text: bytes that do not continue one. */
size_t displayWidth(const std::string& text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

std::string padded(const std::string& text, size_t width, bool right) {
  const size_t own = displayWidth(text);
  const std::string space(width > own ? width - own : 0, ' ');
  return right ? space + text : text + space;
}

}  // namespace

TableFormat tableFormatFromName(const std::string& name) {
  if (name == "text") return TableFormat::kText;
  if (name == "markdown") return TableFormat::kMarkdown;
  if (name == "csv") return TableFormat::kCsv;
  if (name == "json") return TableFormat::kJson;
  throw ConfigError("table format '" + name + "': expected text, markdown, csv or json");
}

void Table::addRow() { rows_.emplace_back(columns_.size()); }

size_t Table::indexOf(const std::string& key) const {
  for (size_t c = 0; c < columns_.size(); ++c)
    if (columns_[c].key == key) return c;
  throw Error("table: there is no column '" + key + "'");
}

void Table::setText(const std::string& key, const std::string& text) {
  Cell& cell = rows_.back()[indexOf(key)];
  cell.text = text;
  cell.empty = text.empty();
}

void Table::setNumber(const std::string& key, double value) {
  Cell& cell = rows_.back()[indexOf(key)];
  cell.value = value;
  cell.text = formatted("%.*g", 9, value);
  cell.empty = !std::isfinite(value);
}

std::string Table::toString(TableFormat format) const {
  switch (format) {
    case TableFormat::kText:
      return aligned(false);
    case TableFormat::kMarkdown:
      return aligned(true);
    case TableFormat::kCsv:
      return csv();
    case TableFormat::kJson:
      break;
  }
  return json();
}

std::string Table::rounded(size_t column, const Cell& cell) const {
  if (cell.empty) return "-";
  const Column& c = columns_[column];
  return c.number ? formatted("%.*f", c.decimals, c.factor * cell.value) : cell.text;
}

std::string Table::aligned(bool markdown) const {
  std::vector<size_t> shown;
  for (size_t c = 0; c < columns_.size(); ++c)
    if (!columns_[c].data_only) shown.push_back(c);

  std::vector<std::vector<std::string>> lines(1 + rows_.size());
  std::vector<size_t> widths;
  for (const size_t c : shown) {
    lines[0].push_back(columns_[c].title);
    for (size_t r = 0; r < rows_.size(); ++r) lines[r + 1].push_back(rounded(c, rows_[r][c]));
    widths.push_back(3);
    for (auto& line : lines) {
      if (markdown) line.back() = markdownField(line.back());
      widths.back() = std::max(widths.back(), displayWidth(line.back()));
    }
  }
  std::vector<std::string> rule;
  for (size_t i = 0; i < shown.size(); ++i) {
    rule.emplace_back(widths[i], '-');
    if (markdown && columns_[shown[i]].number) rule.back().back() = ':';
  }
  lines.insert(lines.begin() + 1, rule);

  std::string text;
  for (const auto& cells : lines) {
    std::string line = markdown ? "| " : "";
    for (size_t i = 0; i < cells.size(); ++i) {
      if (i > 0) line += markdown ? " | " : "  ";
      line += padded(cells[i], widths[i], columns_[shown[i]].number);
    }
    text += markdown ? line + " |\n" : line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string Table::csv() const {
  std::string text;
  for (size_t c = 0; c < columns_.size(); ++c)
    text += (c > 0 ? "," : "") + csvField(columns_[c].key);
  text += "\n";
  for (const std::vector<Cell>& row : rows_) {
    for (size_t c = 0; c < row.size(); ++c)
      text += (c > 0 ? "," : "") + (row[c].empty ? "" : csvField(row[c].text));
    text += "\n";
  }
  return text;
}

std::string Table::json() const {
  using Json = nlohmann::ordered_json;
  Json array = Json::array();
  for (const std::vector<Cell>& row : rows_) {
    Json object;
    for (size_t c = 0; c < row.size(); ++c) {
      Json& value = object[columns_[c].key];
      if (row[c].empty) continue;
      if (columns_[c].number)
        value = std::stod(row[c].text);
      else
        value = row[c].text;
    }
    array.push_back(object);
  }
  return array.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

Table emptyComparison(bool one_source, bool all_succeeded) {
  return Table({{"run", "run"},
                {"source", "source", false, 0, 1.0, one_source},
                {"initializer", "initializer"},
                {"initialized_at_s", "init [s]", true, 2},
                {"attempts", "attempts", true, 0},
                {"status", "status", false, 0, 1.0, all_succeeded},
                {"stage", "stage"},
                {"rre_deg", "RRE [deg]", true, 4},
                {"ate_m", "ATE [mm]", true, 2, 1e3},
                {"gravity_deg", "gravity [deg]", true, 2},
                {"velocity_mps", "v [m/s]", true, 4},
                {"gyro_bias_rps", "b_g [rad/s]", true, 5},
                {"accel_bias_mps2", "b_a [m/s2]", true, 3},
                {"scale_error", "scale [-]", true, 4},
                {"ms", "time [ms]", true, 2},
                {"trajectory_ate_m", "whole ATE [mm]", true, 1, 1e3}});
}

/** The last part of a path: the folder or file that it names. */
std::string lastPart(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  const size_t slash = path.rfind('/');
  return slash == std::string::npos || path.size() == 1 ? path : path.substr(slash + 1);
}

/** The accepted attempt, else the last that has a stage, else the last; null if there is none. */
const AttemptRecord* attemptToShow(const RunRecord& record) {
  if (const AttemptRecord* accepted = record.acceptedAttempt()) return accepted;
  for (auto attempt = record.attempts.rbegin(); attempt != record.attempts.rend(); ++attempt)
    if (!attempt->stages.empty()) return &*attempt;
  return record.attempts.empty() ? nullptr : &record.attempts.back();
}

void addRunCells(Table* table, const std::string& name, const RunRecord& record,
                 const AttemptRecord* attempt) {
  table->addRow();
  table->setText("run", name);
  table->setText("source", lastPart(record.source));
  table->setText("initializer", record.initializer);
  if (record.initialized_at)
    table->setNumber("initialized_at_s",
                     secondsBetween(record.first_image, *record.initialized_at));
  table->setNumber("attempts", static_cast<double>(record.attempts.size()));
  table->setText("status", attempt ? attempt->status : "no attempt");
  if (record.trajectory_errors)
    table->setNumber("trajectory_ate_m", record.trajectory_errors->position_m.rmse);
}

void addStageCells(Table* table, const AttemptRecord& attempt, const StageRecord& stage) {
  table->setText("stage", stage.stage);
  table->setNumber(
      "ms", attempt.milliseconds(stage.stage == kStageInit ? kTimingInitialize : stage.stage));
  if (!stage.errors) return;
  table->setNumber("rre_deg", stage.errors->rre_deg);
  table->setNumber("ate_m", stage.errors->ate_m);
  table->setNumber("gravity_deg", stage.errors->gravity_deg);
  table->setNumber("velocity_mps", stage.errors->velocity_mps);
  table->setNumber("gyro_bias_rps", stage.errors->gyro_bias_rps);
  table->setNumber("accel_bias_mps2", stage.errors->accel_bias_mps2);
  table->setNumber("scale_error", stage.errors->scale_error);
}

}  // namespace

Table compareRuns(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  bool one_source = true, all_succeeded = true;
  for (const auto& [name, record] : runs) {
    one_source = one_source && record.source == runs.front().second.source;
    all_succeeded = all_succeeded && record.acceptedAttempt() != nullptr;
  }
  Table table = emptyComparison(one_source, all_succeeded);
  for (const auto& [name, record] : runs) {
    const AttemptRecord* attempt = attemptToShow(record);
    if (!attempt || attempt->stages.empty()) {
      addRunCells(&table, name, record, attempt);
      continue;
    }
    for (const StageRecord& stage : attempt->stages) {
      addRunCells(&table, name, record, attempt);
      addStageCells(&table, *attempt, stage);
    }
  }
  return table;
}

std::vector<std::string> refusalsOf(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  std::vector<std::string> sentences;
  for (const auto& [name, record] : runs) {
    if (record.acceptedAttempt()) continue;
    std::string sentence = name + ": never initialised; ";
    if (record.attempts.empty()) {
      sentence += "the window of keyframes was never full";
    } else {
      const AttemptRecord& last = record.attempts.back();
      sentence += std::to_string(record.attempts.size()) +
                  (record.attempts.size() == 1 ? " attempt" : " attempts") +
                  ", the last one: " + last.status + ", " + last.reason;
    }
    sentences.push_back(sentence);
  }
  return sentences;
}

}  // namespace etalon
