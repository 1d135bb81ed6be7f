#pragma once

#include <string>
#include <utility>
#include <vector>

namespace etalon {

/** How text shows the marked cells of a table. */
enum class CellMark {
  kNone,
  kTerminalBold,  ///< a terminal's bold (ANSI escape codes)
  kStar,          ///< `*` behind them
};

/** How text is laid out. */
struct TextStyle {
  CellMark mark = CellMark::kNone;
  /** A table with more characters in a line is cut between its groups of columns (else within them)
   * into several below each other, each with the columns left of the first group. 0: never. */
  int width = 0;
};

enum class TableFormat { kText, kMarkdown, kCsv, kJson, kLatex, kHtml };

/** "text", "markdown", "csv", "json", "latex" or "html". @throws ConfigError for anything else. */
TableFormat tableFormatFromName(const std::string& name);

/** The names that tableFormatFromName() knows. */
std::vector<std::string> tableFormatNames();

/** A table of texts and numbers. */
class Table {
 public:
  struct Column {
    std::string key;           ///< for CSV and JSON, e.g. "ate_m"
    std::string title;         ///< for people, e.g. "ATE [mm]"
    bool number = false;       ///< aligned right; unquoted in JSON
    int decimals = 0;          ///< for people
    double factor = 1.0;       ///< from the key's unit to the title's
    bool data_only = false;    ///< in CSV and JSON only
    std::string group = {};    ///< title above neighbouring columns that share it; may be empty
    bool people_only = false;  ///< not in CSV and JSON
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /** Printed above the table for people; not in CSV and JSON. */
  void setCaption(const std::string& caption) { caption_ = caption; }

  /** Adds a row of empty cells, which the calls below fill. */
  void addRow();
  /** A line above the next row, where the format has one. */
  void addRule() { rules_.push_back(rows_.size()); }
  void setText(const std::string& key, const std::string& text);
  /** NaN leaves the cell empty. */
  void setNumber(const std::string& key, double value);
  /** Marks a cell of the last row: `**` in Markdown, \textbf in LaTeX, <b> in HTML. */
  void setBold(const std::string& key);
  /** Marks the least (or the greatest) number among these columns of the last row, and all that are
   * printed alike. Nothing where fewer than two cells have a number. */
  void markBest(const std::vector<std::string>& keys, bool least_is_best = true);

  const std::vector<Column>& columns() const { return columns_; }
  std::size_t rowCount() const { return rows_.size(); }

  /**
   * For people (text, Markdown, LaTeX with booktabs and multirow's \multicolumn, HTML with class
   * "etalon"): columns aligned, numbers in the title's unit and rounded, "-" for an empty cell. CSV
   * (RFC 4180) and JSON (an array of objects): numbers in `%.9g`, an empty cell is empty or null.
   * @param style of text alone
   */
  std::string toString(TableFormat format, const TextStyle& style = {}) const;

 private:
  struct Cell {
    std::string text;
    double value = 0.0;
    bool empty = true;
    bool bold = false;
  };
  /** Columns `first` to `first + count - 1` of those shown, below one title. */
  struct Group {
    std::string title;
    std::size_t first = 0, count = 0;
  };

  std::size_t indexOf(const std::string& key) const;
  std::vector<std::size_t> shownColumns() const;
  std::vector<std::size_t> dataColumns() const;
  std::vector<Group> groups(const std::vector<std::size_t>& shown) const;
  bool hasRuleAbove(std::size_t row) const;
  std::string rounded(std::size_t column, const Cell& cell) const;
  std::string field(std::size_t column, const Cell& cell, const TextStyle& style) const;
  std::vector<std::size_t> widths(const std::vector<std::size_t>& shown,
                                  const TextStyle& style) const;
  std::vector<std::vector<std::size_t>> pieces(const TextStyle& style) const;
  std::string text(const TextStyle& style) const;
  std::string textPiece(const std::vector<std::size_t>& shown, const TextStyle& style) const;
  std::string markdown() const;
  std::string csv() const;
  std::string json() const;
  std::string latex() const;
  std::string html() const;

  std::string caption_;
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
  std::vector<std::size_t> rules_;  ///< rows with a line above
};

}  // namespace etalon
