#include "etalon/report/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

Table smallTable() {
  Table table({{"name", "name"},
               {"value", "value [mm]", true, 1, 1000.0},
               {"more", "more", false, 0, 1.0, true}});
  table.addRow();
  table.setText("name", "a,\"b\"|c");
  table.setNumber("value", 1.23456789012);
  table.setText("more", "x");
  table.addRow();
  table.setText("name", "caf\xC3\xA9");
  table.setNumber("value", std::numeric_limits<double>::quiet_NaN());
  return table;
}

TEST(Table, TextIsAlignedAndRounded) {
  EXPECT_EQ(smallTable().toString(TableFormat::kText),
            "name     value [mm]\n"
            "-------  ----------\n"
            "a,\"b\"|c      1234.6\n"
            "caf\xC3\xA9              -\n");
}

TEST(Table, Markdown) {
  EXPECT_EQ(smallTable().toString(TableFormat::kMarkdown),
            "| name     | value [mm] |\n"
            "| -------- | ---------: |\n"
            "| a,\"b\"\\|c |     1234.6 |\n"
            "| caf\xC3\xA9     |          - |\n");
}

TEST(Table, CsvIsQuotedAndKeepsNineDigitsInTheKeysUnit) {
  EXPECT_EQ(smallTable().toString(TableFormat::kCsv),
            "name,value,more\n\"a,\"\"b\"\"|c\",1.23456789,x\ncaf\xC3\xA9,,\n");
}

TEST(Table, CellsCanBeReadInTheKeysUnit) {
  const Table table = smallTable();
  EXPECT_EQ(table.rowCount(), 2u);
  EXPECT_EQ(table.numberAt(0, "value"), 1.23456789012);  // not rounded
  EXPECT_EQ(table.textAt(0, "value"), "1.23456789");
  EXPECT_EQ(table.textAt(0, "name"), "a,\"b\"|c");
  EXPECT_TRUE(std::isnan(table.numberAt(1, "value")));
  EXPECT_EQ(table.textAt(1, "value"), "");
  EXPECT_TRUE(table.hasColumn("more"));
  EXPECT_FALSE(table.hasColumn("value [mm]"));  // that is its title
  EXPECT_THROW(table.numberAt(2, "value"), Error);
  EXPECT_THROW(table.textAt(0, "valu"), Error);
}

TEST(Table, CsvHoldsTheSmallestNumbers) {
  Table table({{"value", "value", true}});
  table.addRow();
  table.setNumber("value", 1e-310);
  EXPECT_EQ(table.toString(TableFormat::kCsv), "value\n1e-310\n");
  EXPECT_EQ(table.numberAt(0, "value"), 1e-310);
}

TEST(Table, RefusesUnknownColumnsAndFormats) {
  Table table = smallTable();
  EXPECT_THROW(table.setText("nam", "x"), Error);
  EXPECT_EQ(tableFormatFromName("markdown"), TableFormat::kMarkdown);
  EXPECT_THROW(tableFormatFromName("xml"), ConfigError);
  for (const std::string& name : tableFormatNames()) EXPECT_NO_THROW(tableFormatFromName(name));
}

/** Two methods without and with VI-BA, as the papers print them. */
Table groupedTable() {
  Table table({{"sequence", "sequence"},
               {"a", "a_b", true, 2, 1.0, false, "Without"},
               {"b", "b", true, 2, 1.0, false, "Without"},
               {"c", "c", true, 2, 1.0, false, "With VI-BA & more"}});
  table.setCaption("Errors <50% of all");
  table.addRow();
  table.setText("sequence", "V1_01");
  table.setNumber("a", 0.123);
  table.setNumber("b", 0.124);
  table.markBest({"a", "b"});  // alike where they are printed: both
  table.addRule();
  table.addRow();
  table.setText("sequence", "all");
  table.setNumber("a", 1.0);
  table.setNumber("b", 0.5);
  table.setNumber("c", 0.75);
  table.markBest({"a", "b"});
  table.markBest({"c"});  // nothing to compare with
  return table;
}

TEST(Table, GroupsRulesAndCaptionInText) {
  const std::string plain =
      "Errors <50% of all\n"
      "          Without     With VI-BA & more\n"
      "sequence   a_b     b                  c\n"
      "--------  ----  ----  -----------------\n"
      "V1_01     0.12  0.12                  -\n"
      "--------  ----  ----  -----------------\n"
      "all       1.00  0.50               0.75\n";
  EXPECT_EQ(groupedTable().toString(TableFormat::kText), plain);
  EXPECT_THAT(groupedTable().toString(TableFormat::kText, {CellMark::kTerminalBold, 0}),
              HasSubstr("all       1.00  \033[1m0.50\033[0m               0.75\n"));
}

TEST(Table, StarsInTextKeepThePointsBelowEachOther) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kText, {CellMark::kStar, 0}),
            "Errors <50% of all\n"
            "          Without       With VI-BA & more\n"
            "sequence    a_b      b                  c\n"
            "--------  -----  -----  -----------------\n"
            "V1_01     0.12*  0.12*                  -\n"
            "--------  -----  -----  -----------------\n"
            "all       1.00   0.50*               0.75\n");
}

TEST(Table, TextThatIsTooWideIsCutBetweenGroups) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kText, {CellMark::kNone, 30}),
            "Errors <50% of all\n"
            "          Without\n"
            "sequence   a_b     b\n"
            "--------  ----  ----\n"
            "V1_01     0.12  0.12\n"
            "--------  ----  ----\n"
            "all       1.00  0.50\n"
            "\n"
            "          With VI-BA & more\n"
            "sequence                  c\n"
            "--------  -----------------\n"
            "V1_01                     -\n"
            "--------  -----------------\n"
            "all                    0.75\n");
  // A group that is too wide is cut as well; one column always remains.
  EXPECT_THAT(groupedTable().toString(TableFormat::kText, {CellMark::kNone, 10}),
              HasSubstr("sequence        b\n"));
  EXPECT_EQ(groupedTable().toString(TableFormat::kText, {CellMark::kNone, 39}),
            groupedTable().toString(TableFormat::kText));
}

TEST(Table, GroupsAndBoldInMarkdown) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kMarkdown),
            "Errors <50% of all\n\n"
            "| sequence | Without: a_b | Without: b | With VI-BA & more: c |\n"
            "| -------- | -----------: | ---------: | -------------------: |\n"
            "| V1_01    |     **0.12** |   **0.12** |                    - |\n"
            "| all      |         1.00 |   **0.50** |                 0.75 |\n");
}

TEST(Table, Latex) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kLatex),
            "\\begin{table}\n\\centering\n\\caption{Errors <50\\% of all}\n"
            "\\begin{tabular}{@{}lrrr@{}}\n\\toprule\n"
            "\\multicolumn{1}{c}{} & \\multicolumn{2}{c}{Without} & "
            "\\multicolumn{1}{c}{With VI-BA \\& more} \\\\\n"
            "sequence & a\\_b & b & c \\\\\n\\midrule\n"
            "V1\\_01 & \\textbf{0.12} & \\textbf{0.12} & - \\\\\n\\midrule\n"
            "all & 1.00 & \\textbf{0.50} & 0.75 \\\\\n\\bottomrule\n"
            "\\end{tabular}\n\\end{table}\n");
}

TEST(Table, Html) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kHtml),
            "<table class=\"etalon\">\n<caption>Errors &lt;50% of all</caption>\n<thead>\n"
            "<tr><th colspan=\"1\" scope=\"colgroup\"></th>"
            "<th colspan=\"2\" scope=\"colgroup\">Without</th>"
            "<th colspan=\"1\" scope=\"colgroup\">With VI-BA &amp; more</th></tr>\n"
            "<tr><th scope=\"col\">sequence</th><th class=\"number\" scope=\"col\">a_b</th>"
            "<th class=\"number\" scope=\"col\">b</th>"
            "<th class=\"number\" scope=\"col\">c</th></tr>\n</thead>\n<tbody>\n"
            "<tr><td>V1_01</td><td class=\"number\"><b>0.12</b></td>"
            "<td class=\"number\"><b>0.12</b></td><td class=\"number\">-</td></tr>\n"
            "<tr class=\"total\"><td>all</td><td class=\"number\">1.00</td>"
            "<td class=\"number\"><b>0.50</b></td><td class=\"number\">0.75</td></tr>\n"
            "</tbody>\n</table>\n");
}

TEST(Table, CaptionAndBoldAreNotInData) {
  EXPECT_EQ(groupedTable().toString(TableFormat::kCsv),
            "sequence,a,b,c\nV1_01,0.123,0.124,\nall,1,0.5,0.75\n");
}

}  // namespace
}  // namespace etalon
