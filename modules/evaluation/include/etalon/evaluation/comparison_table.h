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
    std::string key;         ///< for CSV and JSON, e.g. "ate_m"
    std::string title;       ///< for people, e.g. "ATE [mm]"
    bool number = false;     ///< aligned right; unquoted in JSON
    int decimals = 0;        ///< in text and Markdown
    double factor = 1.0;     ///< from the key's unit to the title's
    bool data_only = false;  ///< not in text and Markdown
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /** Adds a row of empty cells, which the calls below fill. */
  void addRow();
  void setText(const std::string& key, const std::string& text);
  /** NaN leaves the cell empty. */
  void setNumber(const std::string& key, double value);

  /**
   * Text and Markdown: columns aligned, numbers in the title's unit and rounded, "-" for an empty
   * cell. CSV (RFC 4180) and JSON (an array of objects): numbers in `%.9g`, an empty cell is empty
   * or null.
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
 * so far; a run whose attempts have no stage has one row, with the last attempt's status. Text and
 * Markdown leave the source out where it is the same for all, and the status where all succeeded.
 * @param runs name (e.g. the folder) and record of each
 */
Table compareRuns(const std::vector<std::pair<std::string, RunRecord>>& runs);

/** A sentence for each run that never initialised: how many attempts, and why the last failed. */
std::vector<std::string> refusalsOf(const std::vector<std::pair<std::string, RunRecord>>& runs);

}  // namespace etalon
