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
  /** A table with longer lines is cut between its groups of columns (else within them) into several
   * tables below each other, each with the columns left of the first group. 0: never. */
  int width = 0;
};

/** HTML is for the report alone, which needs the tables in its page. */
enum class TableFormat { kText, kMarkdown, kCsv, kLatex, kHtml };

/** "text", "markdown", "csv" or "latex". @throws ConfigError for anything else. */
TableFormat tableFormatFromName(const std::string& name);

/** The names that tableFormatFromName() knows. */
std::vector<std::string> tableFormatNames();

/** A table of texts and numbers. */
class Table {
 public:
  struct Column {
    std::string key;           ///< for CSV, e.g. "ate_m"
    std::string title;         ///< for people, e.g. "ATE [mm]"
    bool number = false;       ///< aligned right
    int decimals = 0;          ///< for people
    double factor = 1.0;       ///< from the key's unit to the title's
    bool data_only = false;    ///< in CSV only
    std::string group = {};    ///< title above neighbouring columns that share it; may be empty
    bool people_only = false;  ///< not in CSV
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /** Printed above the table for people; not in CSV. */
  void setCaption(const std::string& caption) { caption_ = caption; }

  /** Adds a row of empty cells, which the calls below fill. */
  void addRow();
  /** Draws a line above the next row, where the format has lines. */
  void addRule() { rules_.push_back(rows_.size()); }
  void setText(const std::string& key, const std::string& text);
  /** NaN leaves the cell empty. */
  void setNumber(const std::string& key, double value);
  /** Marks the least (or the greatest) number among these columns of the last row, and all that
   * differ from it by less than one in the last digit, or than 1 % (whole numbers: not at all): `**`
   * in Markdown, `\textbf` in LaTeX, `<b>` in HTML. Marks nothing where fewer than two cells have a number. */
  void markBest(const std::vector<std::string>& keys, bool least_is_best = true);
  /** The same among these rows of a column. */
  void markBestOfColumn(const std::string& key, const std::vector<std::size_t>& rows,
                        bool least_is_best = true);

  const std::vector<Column>& columns() const { return columns_; }
  std::size_t rowCount() const { return rows_.size(); }
  /** A number in the unit of its key; NaN where the cell is empty. @throws Error if there is no
   * such column or row */
  double numberAt(std::size_t row, const std::string& key) const;
  /** The text of a cell in CSV. @throws like numberAt() */
  std::string textAt(std::size_t row, const std::string& key) const;
  /** Whether there is a column of that key. */
  bool hasColumn(const std::string& key) const;

  /**
   * For people (text, Markdown, LaTeX with booktabs and `\multicolumn`, HTML with class
   * "etalon"): columns aligned, numbers in the title's unit and rounded, "-" for an empty cell. CSV
   * (RFC 4180): numbers in `%.9g`, an empty cell is empty.
   * @param style for text only
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
  /** Marks the best of the cells that are not empty. @param columns of each cell */
  void mark(const std::vector<Cell*>& cells, const std::vector<std::size_t>& columns,
            bool least_is_best);
  const Cell& cellAt(std::size_t row, const std::string& key) const;
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
  std::string latex() const;
  std::string html() const;

  std::string caption_;
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
  std::vector<std::size_t> rules_;  ///< rows with a line above
};

}  // namespace etalon
