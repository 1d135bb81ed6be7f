#include "trial/trial_differences.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/testing/example_trial.h"

namespace etalon {
namespace {

using testing::exampleTrial;
using ::testing::HasSubstr;

/** The table of differences of the example with so many starts in "a" and in "b", so many seconds
 * apart; a run lasts ten. */
TitledTable differencesOf(int in_a, int in_b, double every_s) {
  TrialRecord record = exampleTrial();
  record.results.clear();
  for (const auto& [recording, count] : {std::pair("a", in_a), {"b", in_b}})
    for (int i = 0; i < count; ++i)
      for (const TrialVariant& variant : variantsOf(record))
        record.results.push_back(testing::exampleRun(recording, every_s * i, variant, kNoFault,
                                                     variant.initializer == "one" ? 2.0 : 3.0));
  return differenceTable(record);
}

TEST(TrialDifferences, AreRunByRun) {
  const TitledTable six = differencesOf(3, 3, 10.0);
  ASSERT_EQ(six.table.rowCount(), 1U);
  EXPECT_EQ(six.table.textAt(0, "a"), "two");
  EXPECT_EQ(six.table.numberAt(0, "pairs"), 6.0);
  EXPECT_NEAR(six.table.numberAt(0, "difference_m"), 0.001, 1e-12);  // rounding alone
  EXPECT_EQ(six.table.textAt(0, "verdict"), "one is better");
  EXPECT_THAT(six.note, HasSubstr("There are 2 recordings: too few"));
}

TEST(TrialDifferences, FewRunsOrThoseThatOverlapShowNoDifference) {
  const auto verdict = [](const TitledTable& differences) {
    return differences.table.textAt(0, "verdict");
  };
  EXPECT_EQ(verdict(differencesOf(1, 0, 10.0)), "too few pairs");
  EXPECT_EQ(verdict(differencesOf(3, 2, 10.0)), "too few pairs");
  // Runs of ten seconds every five: two overlap, so of twelve six do not, and of ten five.
  EXPECT_EQ(verdict(differencesOf(6, 6, 5.0)), "one is better");
  EXPECT_EQ(verdict(differencesOf(6, 4, 5.0)), "too few pairs");
  const TitledTable one = differencesOf(6, 0, 10.0);
  EXPECT_EQ(verdict(one), "one is better, this recording alone");
  EXPECT_THAT(one.note, HasSubstr("for this flight alone"));
}

}  // namespace
}  // namespace etalon
