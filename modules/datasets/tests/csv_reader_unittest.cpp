#include "euroc/csv_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/testing/temporary_folder.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kColumns = "3 columns (stamp [ns], x, y)";

class CsvFile : public ::testing::Test {
 protected:
  CsvReader reader(const std::string& content) const {
    return CsvReader(folder.write("data.csv", content), kColumns);
  }
  /** The error of reading all rows, with the numbers of each. */
  std::string errorOf(const std::string& content) const {
    return dataErrorOf([&] {
      CsvReader rows = reader(content);
      while (rows.next({3}))
        for (size_t column = 1; column < rows.size(); ++column) rows.number(column);
    });
  }

  TemporaryFolder folder;
};

TEST_F(CsvFile, KnowsTheLineOfEveryRow) {
  CsvReader rows = reader("\xEF\xBB\xBF#stamp,x,y\r\n\n10, 1.5 ,+2\r\n  # a remark\n20,-1e-3,0.25");
  ASSERT_TRUE(rows.next({3}));
  EXPECT_EQ(rows.stamp(), 10);
  EXPECT_EQ(rows.line(), 3);
  EXPECT_EQ(rows.text(1), "1.5");
  EXPECT_EQ(rows.number(2), 2.0);
  ASSERT_TRUE(rows.next({3}));
  EXPECT_EQ(rows.line(), 5);
  EXPECT_EQ(rows.number(1), -1e-3);
  EXPECT_EQ(rows.number(2), 0.25);
  EXPECT_FALSE(rows.next({3}));
}

TEST_F(CsvFile, RowsMayHaveOneOfSeveralWidths) {
  CsvReader rows = reader("1,2\n2,3,4\n3,4,5,6\n");
  EXPECT_TRUE(rows.next({2, 3}));
  EXPECT_EQ(rows.size(), 2U);
  EXPECT_TRUE(rows.next({2, 3}));
  EXPECT_EQ(rows.size(), 3U);
  EXPECT_THAT(dataErrorOf([&] {
                rows.next({2, 3});
              }),
              AllOf(HasSubstr("data.csv:3: "), HasSubstr(kColumns), HasSubstr("found 4")));
}

TEST_F(CsvFile, AFieldMayBeEmptyButIsNoNumber) {
  EXPECT_THAT(errorOf("1,2,\n"), AllOf(HasSubstr("data.csv:1: "), HasSubstr("column 3, found ''")));
  EXPECT_THAT(errorOf(",2,3\n"), HasSubstr("found ''"));
}

TEST_F(CsvFile, RefusesWhatIsNoFiniteNumber) {
  for (const char* wrong : {"nan", "inf", "-inf", "1e999", "1.5x", "0x10", "1 2", "++1", "1,5"})
    EXPECT_NE(errorOf(std::string("1,2,") + wrong + "\n"), "") << wrong;
  EXPECT_EQ(errorOf("1,2,1e308\n"), "");
}

TEST_F(CsvFile, AMeasurementMayBeNoFiniteNumberButIsANumber) {
  CsvReader rows = reader("1,nan,-inf\n2,1e999,1.5x\n");
  ASSERT_TRUE(rows.next({3}));
  EXPECT_TRUE(std::isnan(rows.measurement(1)));
  EXPECT_EQ(rows.measurement(2), -HUGE_VAL);
  ASSERT_TRUE(rows.next({3}));
  for (const size_t column : {1U, 2U})
    EXPECT_THAT(dataErrorOf([&] { rows.measurement(column); }),
                AllOf(HasSubstr("data.csv:2: expected a number in column")));
}

TEST_F(CsvFile, StampsIncreaseStrictlyAndStayInsideTheClock) {
  EXPECT_EQ(errorOf("0,1,1\n4000000000000000000,1,1\n"), "");
  EXPECT_THAT(errorOf("-1,1,1\n"), HasSubstr("from 0 to 4000000000000000000, found '-1'"));
  EXPECT_NE(errorOf("4000000000000000001,1,1\n"), "");
  EXPECT_NE(errorOf("99999999999999999999,1,1\n"), "");
  EXPECT_NE(errorOf("1.0,1,1\n"), "");
  EXPECT_THAT(errorOf("5,1,1\n5,1,1\n"), HasSubstr("found 5 after 5 (duplicate)"));
  EXPECT_THAT(errorOf("5,1,1\n4,1,1\n"), HasSubstr("data.csv:2: "));
}

TEST_F(CsvFile, AFileThatIsNotThereIsNamedWithWhatItShouldHold) {
  EXPECT_THAT(dataErrorOf([&] { CsvReader((folder / "none.csv").string(), kColumns); }),
              AllOf(HasSubstr("none.csv"), HasSubstr("no such file"), HasSubstr(kColumns)));
  EXPECT_NE(dataErrorOf([&] { CsvReader(folder.path(), kColumns); }), "");  // a folder
}

}  // namespace
}  // namespace etalon::testing
