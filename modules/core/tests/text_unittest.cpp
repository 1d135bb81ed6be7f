#include "etalon/core/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace etalon {
namespace {

TEST(Text, FormatsTextsOfAnyLength) {
  EXPECT_EQ(format("%d of %s, %.2f", 3, "five", 0.125), "3 of five, 0.12");
  EXPECT_EQ(format("%s", std::string(1000, 'x').c_str()).size(), 1000U);
}

TEST(Text, CsvFieldsAreQuotedWhereTheyMustBe) {
  EXPECT_EQ(csvField("plain text; with 'quotes'"), "plain text; with 'quotes'");
  EXPECT_EQ(csvField("a,b"), "\"a,b\"");
  EXPECT_EQ(csvField("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(csvField("a\rb"), "\"a\rb\"");
  EXPECT_EQ(csvField("say \"no\""), "\"say \"\"no\"\"\"");
  EXPECT_EQ(csvField(""), "");
}

TEST(Text, CsvNumbersHaveNineDigitsAndNoNaN) {
  EXPECT_EQ(csvNumber(1.0 / 3.0), "0.333333333");
  EXPECT_EQ(csvNumber(-2e-12), "-2e-12");
  EXPECT_EQ(csvNumber(std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_EQ(csvNumber(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Text, EachFormatEscapesItsOwnCharacters) {
  const std::string all = "a|b_c%d&e<f>\"g\"\\h~i^j{k}#$";
  EXPECT_EQ(markdownText(all), "a\\|b_c%d&e<f>\"g\"\\h~i^j{k}#$");
  EXPECT_EQ(latexText(all),
            "a|b\\_c\\%d\\&e<f>\"g\"\\textbackslash{}h\\textasciitilde{}i\\textasciicircum{}j"
            "\\{k\\}\\#\\$");
  EXPECT_EQ(htmlText(all), "a|b_c%d&amp;e&lt;f&gt;&quot;g&quot;\\h~i^j{k}#$");
}

TEST(Text, JoinsWords) {
  EXPECT_EQ(joined({}), "");
  EXPECT_EQ(joined({"one"}), "one");
  EXPECT_EQ(joined({"one", "two", "three"}), "one, two, three");
  EXPECT_EQ(joined({"one", "two"}, " or "), "one or two");
}

TEST(Text, MessagesThatDifferInTheirFiguresAreTheSameWithoutThem) {
  EXPECT_EQ(withoutFigures("gravity +- 1.32 deg of 'eta'"),
            withoutFigures("gravity +- 12 deg of 'vi_orb'"));
  EXPECT_NE(withoutFigures("1 landmark"), withoutFigures("1 keyframe"));
}

TEST(Text, PadsByCharactersNotByBytes) {
  EXPECT_EQ(displayWidth("m/s\xC2\xB2"), 4U);   // superscript two, two bytes
  EXPECT_EQ(displayWidth("\xE2\x80\x93"), 1U);  // a dash, three bytes
  EXPECT_EQ(padded("m/s\xC2\xB2", 6, false), "m/s\xC2\xB2  ");
  EXPECT_EQ(padded("m/s\xC2\xB2", 6, true), "  m/s\xC2\xB2");
  EXPECT_EQ(padded("too long", 3, true), "too long");
}

}  // namespace
}  // namespace etalon
