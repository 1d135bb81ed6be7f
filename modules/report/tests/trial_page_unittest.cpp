#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/text.h"
#include "etalon/report/trial_tables.h"
#include "etalon/testing/example_trial.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(TrialPage, LongNamesLoseTheirMiddle) {
  TrialRecord record = testing::exampleTrial();
  const std::string name = "joint_closed_form_with_\xc3\xa9_and_gravity_", other = name + "two";
  for (TrialRun& run : record.results)
    run.variant.initializer = run.variant.initializer == "one" ? name + "one" : other;
  record.initializers[0].name = name + "one";
  record.initializers[1].name = other;
  sortResults(&record);
  const std::string page = trialPage(record, {});
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(displayWidth(line), 100U) << line;
  EXPECT_THAT(
      page, AllOf(HasSubstr("\njoint_cl"), HasSubstr("_one "), HasSubstr("~"), HasSubstr("_two ")));
  EXPECT_EQ(trialTables(record).front().table.textAt(1, "variant"), other);
}

TEST(TrialPage, NamesAFailureWithItsReason) {
  EXPECT_THAT(
      trialPage(testing::exampleTrial(), {}),
      HasSubstr("failed: b from 20.1 s, two, dark: silent: off by 0.62 m at 7.10 s, 8 times"));
}

}  // namespace
}  // namespace etalon
