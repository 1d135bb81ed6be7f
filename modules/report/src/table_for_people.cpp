#include <algorithm>

#include "etalon/core/text.h"
#include "etalon/report/table.h"

// The renderings of a Table that are for reading.

namespace etalon {
namespace {

std::string trimmed(const std::string& line) {
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

std::string ruleOf(const std::vector<size_t>& widths) {
  std::string line;
  for (size_t i = 0; i < widths.size(); ++i)
    line += (i > 0 ? "  " : "") + std::string(widths[i], '-');
  return line + "\n";
}

/** Characters from the first of `count` columns to the last. */
size_t spanWidth(const std::vector<size_t>& widths, size_t first, size_t count) {
  size_t width = 2 * (count - 1);
  for (size_t i = first; i < first + count; ++i) width += widths[i];
  return width;
}

}  // namespace

/** What stands in a cell of text; the star of a marked one has its place in the whole column. */
std::string Table::field(size_t column, const Cell& cell, const TextStyle& style) const {
  std::string value = rounded(column, cell);
  if (style.mark != CellMark::kStar) return value;
  const bool starred = std::any_of(rows_.begin(), rows_.end(),
                                   [column](const auto& row) { return row[column].bold; });
  if (cell.bold) return value + "*";
  return starred && columns_[column].number ? value + " " : value;
}

std::vector<size_t> Table::widths(const std::vector<size_t>& shown, const TextStyle& style) const {
  std::vector<size_t> widths;
  for (const size_t c : shown) {
    widths.push_back(std::max<size_t>(3, displayWidth(columns_[c].title)));
    for (const auto& row : rows_)
      widths.back() = std::max(widths.back(), displayWidth(field(c, row[c], style)));
  }
  for (const Group& group : groups(shown))  // a long title widens its last column
    if (const size_t own = displayWidth(group.title),
        span = spanWidth(widths, group.first, group.count);
        own > span)
      widths[group.first + group.count - 1] += own - span;
  return widths;
}

/** The shown columns in pieces that are no wider than the style's width, as far as that can be. */
std::vector<std::vector<size_t>> Table::pieces(const TextStyle& style) const {
  const std::vector<size_t> shown = shownColumns();
  const auto fits = [&](const std::vector<size_t>& columns) {
    const std::vector<size_t> all = widths(columns, style);
    return spanWidth(all, 0, all.size()) <= static_cast<size_t>(style.width);
  };
  const auto grouped = std::find_if(shown.begin(), shown.end(),
                                    [this](size_t c) { return !columns_[c].group.empty(); });
  if (style.width <= 0 || grouped == shown.end() || fits(shown)) return {shown};

  const std::vector<size_t> left(shown.begin(), grouped);
  std::vector<std::vector<size_t>> pieces = {left};
  const auto add = [&](const std::vector<size_t>& columns) {
    std::vector<size_t> longer = pieces.back();
    longer.insert(longer.end(), columns.begin(), columns.end());
    if (!fits(longer) && pieces.back().size() > left.size()) {
      longer = left;
      longer.insert(longer.end(), columns.begin(), columns.end());
      pieces.push_back(left);
    }
    if (columns.size() > 1 && !fits(longer)) return false;
    pieces.back() = longer;
    return true;
  };
  for (const Group& group : groups(shown)) {
    if (group.first < left.size()) continue;
    const auto first = shown.begin() + group.first;
    const std::vector<size_t> columns(first, first + group.count);
    if (add(columns)) continue;
    for (const size_t c : columns) add({c});
  }
  return pieces;
}

std::string Table::text(const TextStyle& style) const {
  std::string result = caption_.empty() ? "" : caption_ + "\n";
  bool first = true;
  for (const std::vector<size_t>& piece : pieces(style)) {
    result += (first ? "" : "\n") + textPiece(piece, style);
    first = false;
  }
  return result;
}

std::string Table::textPiece(const std::vector<size_t>& shown, const TextStyle& style) const {
  const std::vector<Group> titled = groups(shown);
  const std::vector<size_t> widths = this->widths(shown, style);
  std::string result, line;
  for (const Group& group : titled) {
    const size_t width = spanWidth(widths, group.first, group.count);
    line += (group.first > 0 ? "  " : "") + padded(group.title, width, false);
  }
  if (!titled.empty()) result += trimmed(line) + "\n";
  line.clear();
  for (size_t i = 0; i < shown.size(); ++i)
    line += (i > 0 ? "  " : "") +
            padded(columns_[shown[i]].title, widths[i], columns_[shown[i]].number);
  result += trimmed(line) + "\n" + ruleOf(widths);
  for (size_t r = 0; r < rows_.size(); ++r) {
    if (hasRuleAbove(r)) result += ruleOf(widths);
    line.clear();
    for (size_t i = 0; i < shown.size(); ++i) {
      const Cell& cell = rows_[r][shown[i]];
      const std::string text =
          padded(field(shown[i], cell, style), widths[i], columns_[shown[i]].number);
      const bool bold = style.mark == CellMark::kTerminalBold && cell.bold;
      line += (i > 0 ? "  " : "") + (bold ? "\033[1m" + text + "\033[0m" : text);
    }
    result += trimmed(line) + "\n";
  }
  return result;
}

std::string Table::markdown() const {
  const std::vector<size_t> shown = shownColumns();
  std::vector<std::vector<std::string>> lines(2 + rows_.size());
  std::vector<size_t> widths;
  for (const size_t c : shown) {
    const Column& column = columns_[c];
    lines[0].push_back(
        markdownText(column.group.empty() ? column.title : column.group + ": " + column.title));
    widths.push_back(std::max<size_t>(3, displayWidth(lines[0].back())));
    for (size_t r = 0; r < rows_.size(); ++r) {
      const std::string field = markdownText(rounded(c, rows_[r][c]));
      lines[r + 2].push_back(rows_[r][c].bold ? "**" + field + "**" : field);
      widths.back() = std::max(widths.back(), displayWidth(lines[r + 2].back()));
    }
    lines[1].emplace_back(widths.back(), '-');
    if (column.number) lines[1].back().back() = ':';
  }
  std::string result = caption_.empty() ? "" : caption_ + "\n\n";
  for (const auto& cells : lines) {
    result += "|";
    for (size_t i = 0; i < cells.size(); ++i)
      result += " " + padded(cells[i], widths[i], columns_[shown[i]].number) + " |";
    result += "\n";
  }
  return result;
}

std::string Table::latex() const {
  const std::vector<size_t> shown = shownColumns();
  std::string result = "\\begin{table}\n\\centering\n";
  if (!caption_.empty()) result += "\\caption{" + latexText(caption_) + "}\n";
  result += "\\begin{tabular}{@{}";
  for (const size_t c : shown) result += columns_[c].number ? "r" : "l";
  result += "@{}}\n\\toprule\n";
  const std::vector<Group> titled = groups(shown);
  for (const Group& group : titled)
    result += (group.first > 0 ? " & " : "") + std::string("\\multicolumn{") +
              std::to_string(group.count) + "}{c}{" + latexText(group.title) + "}";
  if (!titled.empty()) result += " \\\\\n";
  for (size_t i = 0; i < shown.size(); ++i)
    result += (i > 0 ? " & " : "") + latexText(columns_[shown[i]].title);
  result += " \\\\\n\\midrule\n";
  for (size_t r = 0; r < rows_.size(); ++r) {
    if (hasRuleAbove(r)) result += "\\midrule\n";
    for (size_t i = 0; i < shown.size(); ++i) {
      const Cell& cell = rows_[r][shown[i]];
      const std::string field = latexText(rounded(shown[i], cell));
      result += (i > 0 ? " & " : "") + (cell.bold ? "\\textbf{" + field + "}" : field);
    }
    result += " \\\\\n";
  }
  return result + "\\bottomrule\n\\end{tabular}\n\\end{table}\n";
}

std::string Table::html() const {
  const std::vector<size_t> shown = shownColumns();
  std::string result = "<table class=\"etalon\">\n";
  if (!caption_.empty()) result += "<caption>" + htmlText(caption_) + "</caption>\n";
  result += "<thead>\n";
  const std::vector<Group> titled = groups(shown);
  if (!titled.empty()) {
    result += "<tr>";
    for (const Group& group : titled)
      result += "<th colspan=\"" + std::to_string(group.count) + "\" scope=\"colgroup\">" +
                htmlText(group.title) + "</th>";
    result += "</tr>\n";
  }
  const auto side = [&](size_t c) {
    return columns_[c].number ? std::string(" class=\"number\"") : std::string();
  };
  result += "<tr>";
  for (const size_t c : shown)
    result += "<th" + side(c) + " scope=\"col\">" + htmlText(columns_[c].title) + "</th>";
  result += "</tr>\n</thead>\n<tbody>\n";
  for (size_t r = 0; r < rows_.size(); ++r) {
    result += hasRuleAbove(r) ? "<tr class=\"total\">" : "<tr>";
    for (const size_t c : shown) {
      const std::string field = htmlText(rounded(c, rows_[r][c]));
      result +=
          "<td" + side(c) + ">" + (rows_[r][c].bold ? "<b>" + field + "</b>" : field) + "</td>";
    }
    result += "</tr>\n";
  }
  return result + "</tbody>\n</table>\n";
}

}  // namespace etalon
