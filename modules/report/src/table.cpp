#include "etalon/report/table.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon {

std::vector<std::string> tableFormatNames() { return {"text", "markdown", "csv", "latex"}; }

TableFormat tableFormatFromName(const std::string& name) {
  if (name == "text") return TableFormat::kText;
  if (name == "markdown") return TableFormat::kMarkdown;
  if (name == "csv") return TableFormat::kCsv;
  if (name == "latex") return TableFormat::kLatex;
  throw ConfigError("table format '" + name + "': expected text, markdown, csv or latex");
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
  cell.text = format("%.*g", 9, value);
  cell.empty = !std::isfinite(value);
}

bool Table::hasColumn(const std::string& key) const {
  return std::any_of(columns_.begin(), columns_.end(),
                     [&key](const Column& column) { return column.key == key; });
}

const Table::Cell& Table::cellAt(size_t row, const std::string& key) const {
  if (row >= rows_.size()) throw Error("table: there is no row " + std::to_string(row));
  return rows_[row][indexOf(key)];
}

double Table::numberAt(size_t row, const std::string& key) const {
  const Cell& cell = cellAt(row, key);
  return cell.empty ? std::numeric_limits<double>::quiet_NaN() : cell.value;
}

std::string Table::textAt(size_t row, const std::string& key) const {
  const Cell& cell = cellAt(row, key);
  return cell.empty ? "" : cell.text;
}

void Table::mark(const std::vector<Cell*>& cells, const std::vector<size_t>& columns,
                 bool least_is_best) {
  std::vector<size_t> filled;
  for (size_t i = 0; i < cells.size(); ++i)
    if (!cells[i]->empty) filled.push_back(i);
  if (filled.size() < 2) return;
  const size_t best = *std::min_element(filled.begin(), filled.end(), [&](size_t a, size_t b) {
    return least_is_best ? cells[a]->value < cells[b]->value : cells[a]->value > cells[b]->value;
  });
  for (const size_t i : filled) {
    const Column& column = columns_[columns[i]];
    const double difference = column.factor * std::abs(cells[i]->value - cells[best]->value);
    const double one_percent = 0.01 * column.factor * std::abs(cells[best]->value);
    const double alike =
        column.decimals > 0 ? std::max(std::pow(10.0, -column.decimals), one_percent) : 0.5;
    cells[i]->bold = i == best || difference < alike;
  }
}

void Table::markBest(const std::vector<std::string>& keys, bool least_is_best) {
  std::vector<Cell*> cells;
  std::vector<size_t> columns;
  for (const std::string& key : keys) {
    columns.push_back(indexOf(key));
    cells.push_back(&rows_.back()[columns.back()]);
  }
  mark(cells, columns, least_is_best);
}

void Table::markBestOfColumn(const std::string& key, const std::vector<size_t>& rows,
                             bool least_is_best) {
  const size_t column = indexOf(key);
  std::vector<Cell*> cells;
  for (const size_t row : rows) cells.push_back(&rows_.at(row)[column]);
  mark(cells, std::vector<size_t>(cells.size(), column), least_is_best);
}

std::vector<size_t> Table::shownColumns() const {
  std::vector<size_t> shown;
  for (size_t c = 0; c < columns_.size(); ++c)
    if (!columns_[c].data_only) shown.push_back(c);
  return shown;
}

std::vector<size_t> Table::dataColumns() const {
  std::vector<size_t> written;
  for (size_t c = 0; c < columns_.size(); ++c)
    if (!columns_[c].people_only) written.push_back(c);
  return written;
}

std::vector<Table::Group> Table::groups(const std::vector<size_t>& shown) const {
  std::vector<Group> groups;
  bool named = false;
  for (size_t i = 0; i < shown.size(); ++i) {
    const std::string& title = columns_[shown[i]].group;
    named = named || !title.empty();
    if (groups.empty() || groups.back().title != title) groups.push_back({title, i, 0});
    ++groups.back().count;
  }
  return named ? groups : std::vector<Group>();
}

bool Table::hasRuleAbove(size_t row) const {
  return std::find(rules_.begin(), rules_.end(), row) != rules_.end();
}

std::string Table::rounded(size_t column, const Cell& cell) const {
  if (cell.empty) return "-";
  const Column& c = columns_[column];
  return c.number ? format("%.*f", c.decimals, c.factor * cell.value) : cell.text;
}

std::string Table::toString(TableFormat format, const TextStyle& style) const {
  switch (format) {
    case TableFormat::kText:
      return text(style);
    case TableFormat::kMarkdown:
      return markdown();
    case TableFormat::kCsv:
      return csv();
    case TableFormat::kLatex:
      return latex();
    case TableFormat::kHtml:
      break;
  }
  return html();
}

std::string Table::csv() const {
  const std::vector<size_t> written = dataColumns();
  std::string text;
  for (const size_t c : written)
    text += (c != written.front() ? "," : "") + csvField(columns_[c].key);
  text += "\n";
  for (const std::vector<Cell>& row : rows_) {
    for (const size_t c : written)
      text += (c != written.front() ? "," : "") + (row[c].empty ? "" : csvField(row[c].text));
    text += "\n";
  }
  return text;
}

}  // namespace etalon
