// Tables at their limits: nothing in them, cells of other alphabets, ties, columns for one reader.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/errors.h"
#include "etalon/report/table.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr TableFormat kAllFormats[] = {TableFormat::kText, TableFormat::kMarkdown,
                                       TableFormat::kCsv, TableFormat::kLatex, TableFormat::kHtml};

Table numbers(int decimals, double factor, const std::vector<double>& values) {
  Table table({{"value", "value", true, decimals, factor}});
  for (const double value : values) {
    table.addRow();
    table.setNumber("value", value);
  }
  return table;
}

TEST(TableLimits, WithoutRowsThereAreTheTitles) {
  const Table table({{"a_b", "A & B"}, {"n", "number", true}});
  EXPECT_EQ(table.rowCount(), 0U);
  EXPECT_EQ(table.toString(TableFormat::kText), "A & B  number\n-----  ------\n");
  EXPECT_EQ(table.toString(TableFormat::kMarkdown), "| A & B | number |\n| ----- | -----: |\n");
  EXPECT_EQ(table.toString(TableFormat::kCsv), "a_b,n\n");
  EXPECT_THAT(table.toString(TableFormat::kLatex), HasSubstr("A \\& B & number \\\\\n\\midrule\n"));
  EXPECT_THAT(table.toString(TableFormat::kHtml), HasSubstr("<tbody>\n</tbody>"));
  EXPECT_THROW(table.numberAt(0, "n"), Error);
}

TEST(TableLimits, WhatIsNoNumberIsAnEmptyCell) {
  const double inf = std::numeric_limits<double>::infinity();
  const Table table = numbers(1, 1.0, {inf, -inf, std::nan(""), 2.0});
  EXPECT_EQ(table.toString(TableFormat::kCsv), "value\n\n\n\n2\n");
  EXPECT_EQ(table.toString(TableFormat::kText), "value\n-----\n    -\n    -\n    -\n  2.0\n");
  EXPECT_TRUE(std::isnan(table.numberAt(0, "value")));
  EXPECT_EQ(table.textAt(1, "value"), "");
}

TEST(TableLimits, TheLargestNumberHasAllItsDigits) {
  const Table table = numbers(2, 1.0, {std::numeric_limits<double>::max()});
  const std::string text = table.toString(TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("179769313486231570"));
  EXPECT_THAT(text, HasSubstr("368.00\n"));
  EXPECT_EQ(table.toString(TableFormat::kCsv), "value\n1.79769313e+308\n");
}

TEST(TableLimits, TheFactorIsForPeopleAlone) {
  const Table table = numbers(1, 1000.0, {0.01234});
  EXPECT_THAT(table.toString(TableFormat::kText), HasSubstr("12.3"));
  EXPECT_EQ(table.toString(TableFormat::kCsv), "value\n0.01234\n");
  EXPECT_EQ(table.numberAt(0, "value"), 0.01234);
}

TEST(TableLimits, ACellMayBeSetAgain) {
  Table table = numbers(0, 1.0, {5.0});
  table.setNumber("value", std::nan(""));
  EXPECT_EQ(table.textAt(0, "value"), "");
  table.setNumber("value", 6.0);
  EXPECT_EQ(table.textAt(0, "value"), "6");
  Table texts(std::vector<Table::Column>{{"t", "t"}});
  texts.addRow();
  texts.setText("t", "");
  EXPECT_EQ(texts.textAt(0, "t"), "");
  EXPECT_THAT(texts.toString(TableFormat::kText), HasSubstr("-\n"));
}

TEST(TableLimits, ColumnsForOneReaderAreNotForTheOther) {
  Table table({{"both", "both"},
               {"program", "for programs", false, 0, 1.0, true},
               {"people", "for people", false, 0, 1.0, false, "", true}});
  table.addRow();
  table.setText("both", "1");
  table.setText("program", "2");
  table.setText("people", "3");
  EXPECT_EQ(table.toString(TableFormat::kCsv), "both,program\n1,2\n");
  for (const TableFormat format : kAllFormats) {
    if (format == TableFormat::kCsv) continue;
    const std::string text = table.toString(format);
    EXPECT_THAT(text, HasSubstr("for people"));
    EXPECT_THAT(text, Not(HasSubstr("for programs")));
  }
}

/** A row of three numbers, of which the best is marked, in Markdown. */
std::string marked(const std::vector<double>& values, bool least, int decimals = 1) {
  Table table({{"a", "a", true, decimals}, {"b", "b", true, decimals}, {"c", "c", true, decimals}});
  table.addRow();
  const char* keys[] = {"a", "b", "c"};
  for (size_t i = 0; i < 3; ++i) table.setNumber(keys[i], values[i]);
  table.markBest({"a", "b", "c"}, least);
  const std::string text = table.toString(TableFormat::kMarkdown);
  const std::string row = text.substr(0, text.size() - 1);
  std::string cells = row.substr(row.rfind('\n') + 1);
  cells.erase(std::remove(cells.begin(), cells.end(), ' '), cells.end());
  return cells;
}

TEST(TableLimits, TheBestIsTheLeastOrTheGreatestOfThoseThatAreThere) {
  const double none = std::nan("");
  EXPECT_EQ(marked({3.0, 1.0, 2.0}, true), "|3.0|**1.0**|2.0|");
  EXPECT_EQ(marked({3.0, 1.0, 2.0}, false), "|**3.0**|1.0|2.0|");
  EXPECT_EQ(marked({-3.0, 1.0, 2.0}, true), "|**-3.0**|1.0|2.0|");
  EXPECT_EQ(marked({3.0, none, 2.0}, true), "|3.0|-|**2.0**|");
  EXPECT_EQ(marked({3.0, none, none}, true), "|3.0|-|-|");  // nothing to compare with
  EXPECT_EQ(marked({none, none, none}, true), "|-|-|-|");
  // Less than one apart in the last digit, or 1 %: a tie. Whole numbers are counts: each one counts.
  EXPECT_EQ(marked({0.65, 0.6, 0.75}, true), "|**0.7**|**0.6**|0.8|");
  EXPECT_EQ(marked({9.69, 9.6, 9.7}, true, 2), "|**9.69**|**9.60**|9.70|");
  EXPECT_EQ(marked({1.0, 2.0, 1.0}, true, 0), "|**1**|2|**1**|");
}

TEST(TableLimits, TheBestOfAColumnIsMarkedInItsRows) {
  Table table({{"a", "a", true, 2}});
  for (const double value : {3.0, 1.0, 1.009}) {
    table.addRow();
    table.setNumber("a", value);
  }
  table.markBestOfColumn("a", {0, 1, 2});
  EXPECT_EQ(table.toString(TableFormat::kMarkdown),
            "|        a |\n| -------: |\n|     3.00 |\n| **1.00** |\n| **1.01** |\n");
  table.markBestOfColumn("a", {0, 2}, false);
  EXPECT_THAT(table.toString(TableFormat::kMarkdown), HasSubstr("**3.00**"));
}

TEST(TableLimits, AMarkIsOfTheLastRowAlone) {
  Table table({{"a", "a", true}, {"b", "b", true}});
  for (int row = 0; row < 2; ++row) {
    table.addRow();
    table.setNumber("a", row);
    table.setNumber("b", 1 - row);
  }
  table.markBest({"a", "b"});
  EXPECT_EQ(table.toString(TableFormat::kMarkdown),
            "|   a |     b |\n| --: | ----: |\n|   0 |     1 |\n|   1 | **0** |\n");
  EXPECT_THROW(table.markBest({"a", "none"}), Error);
}

TEST(TableLimits, OtherAlphabetsAreCountedInCharacters) {
  Table table({{"name", "n"}, {"x", "x"}});
  for (const char* name : {"\xCF\x83\xCF\x83\xCF\x83\xCF\x83", "abcd"}) {
    table.addRow();
    table.setText("name", name);
    table.setText("x", "|");
  }
  EXPECT_EQ(table.toString(TableFormat::kText),
            "n     x\n----  ---\n\xCF\x83\xCF\x83\xCF\x83\xCF\x83  |\nabcd  |\n");
}

TEST(TableLimits, WhatActsInAFormatIsShownAsItIs) {
  Table table(std::vector<Table::Column>{{"t", "t"}});
  table.addRow();
  table.setText("t", "<b>&\"|_%$#{}~^\\,\n");
  EXPECT_THAT(table.toString(TableFormat::kHtml), HasSubstr("&lt;b&gt;&amp;"));
  EXPECT_THAT(table.toString(TableFormat::kHtml), Not(HasSubstr("<b>")));
  EXPECT_THAT(table.toString(TableFormat::kLatex), HasSubstr("\\_\\%\\$\\#\\{\\}"));
  EXPECT_THAT(table.toString(TableFormat::kMarkdown), HasSubstr("\\|"));
  EXPECT_EQ(table.toString(TableFormat::kCsv), "t\n\"<b>&\"\"|_%$#{}~^\\,\n\"\n");
}

TEST(TableLimits, ARuleMayStandAboveTheFirstRowAndBehindTheLastIsNone) {
  Table table(std::vector<Table::Column>{{"t", "t"}});
  table.addRule();
  table.addRow();
  table.setText("t", "x");
  table.addRule();  // above a row that never comes
  EXPECT_EQ(table.toString(TableFormat::kText), "t\n---\n---\nx\n");
  EXPECT_THAT(table.toString(TableFormat::kHtml), HasSubstr("<tr class=\"total\"><td>x"));
}

}  // namespace
}  // namespace etalon
