#include <algorithm>

#include "etalon/evaluation/table.h"
#include "table_text.h"

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

std::string Table::text(bool terminal_bold) const {
  const std::vector<size_t> shown = shownColumns();
  const std::vector<Group> titled = groups();
  std::vector<size_t> widths;
  for (const size_t c : shown) {
    widths.push_back(std::max<size_t>(3, displayWidth(columns_[c].title)));
    for (const auto& row : rows_)
      widths.back() = std::max(widths.back(), displayWidth(rounded(c, row[c])));
  }
  for (const Group& group : titled)  // a long title widens its last column
    if (const size_t own = displayWidth(group.title),
        span = spanWidth(widths, group.first, group.count);
        own > span)
      widths[group.first + group.count - 1] += own - span;

  std::string result = caption_.empty() ? "" : caption_ + "\n";
  std::string line;
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
      const std::string field =
          padded(rounded(shown[i], cell), widths[i], columns_[shown[i]].number);
      line += (i > 0 ? "  " : "") +
              (terminal_bold && cell.bold ? "\033[1m" + field + "\033[0m" : field);
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
  const std::vector<Group> titled = groups();
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
  const std::vector<Group> titled = groups();
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
