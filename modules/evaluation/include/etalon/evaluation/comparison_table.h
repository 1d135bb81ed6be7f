#pragma once

#include <string>
#include <utility>
#include <vector>

#include "etalon/evaluation/initialization_json.h"

namespace etalon {

enum class TableFormat { kText, kMarkdown, kCsv, kJson };

/** "text", "markdown", "csv" or "json". @throws ConfigError for anything else. */
TableFormat tableFormatFromName(const std::string& name);

/** A table of texts and numbers. */
class Table {
 public:
  struct Column {
    std::string key;      ///< for CSV and JSON, e.g. "rre_deg"
    std::string title;    ///< for people, e.g. "RRE [deg]"
    bool number = false;  ///< aligned right; unquoted in JSON
    int digits = 4;       ///< significant ones, in text and Markdown
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /** Adds a row of empty cells, which the calls below fill. */
  void addRow();
  void setText(const std::string& key, const std::string& text);
  /** NaN leaves the cell empty. */
  void setNumber(const std::string& key, double value);

  /**
   * Text and Markdown: columns aligned, numbers rounded, "-" for an empty cell. CSV (RFC 4180) and
   * JSON (an array of objects): numbers in `%.9g`, an empty cell is empty or null.
   */
  std::string toString(TableFormat format) const;

 private:
  struct Cell {
    std::string text;
    double value = 0.0;
    bool empty = true;
  };
  size_t indexOf(const std::string& key) const;
  std::string aligned(bool markdown) const;
  std::string csv() const;
  std::string json() const;
  std::string rounded(size_t column, const Cell& cell) const;

  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
};

/**
 * One row a run and stage (`init`, `vi_ba`) of its accepted attempt, else of the last one that got
 * so far; a run whose attempts have no stage has one row, with the last attempt's status.
 * @param runs name (e.g. the folder) and record of each
 */
Table compareRuns(const std::vector<std::pair<std::string, RunRecord>>& runs);

/** A sentence for each run that never initialised: how many attempts, and why the last failed. */
std::vector<std::string> refusalsOf(const std::vector<std::pair<std::string, RunRecord>>& runs);

}  // namespace etalon
