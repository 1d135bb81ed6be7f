#include "etalon/benchmark/trial/trial_summary.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/testing/example_trial.h"

namespace etalon {
namespace {

using testing::exampleTrial;

TEST(TrialSummary, CountsAndTakesMedians) {
  const TrialRecord record = exampleTrial();
  const TrialSummary all = summaryOf(record, [](const TrialRun&) { return true; });
  EXPECT_EQ(all.runs, 16);
  EXPECT_EQ(all.survived, 15);
  EXPECT_EQ(all.silent, 1);
  EXPECT_EQ(all.faulty, 8);
  EXPECT_EQ(all.reported, 7);
  EXPECT_DOUBLE_EQ(all.coverage, (15 * 200 + 150) / (16 * 200.0));
  const TrialSummary one = summaryOf(record, [](const TrialRun& run) {
    return run.variant.initializer == "one" && run.fault == kNoFault;
  });
  EXPECT_EQ(one.runs, 4);
  EXPECT_NEAR(one.causal_ate_m.median, 0.0025, 1e-12);  // 2, 2, 3, 3 mm
  EXPECT_NEAR(one.smoothed_ate_m.median, 0.00125, 1e-12);
  EXPECT_EQ(one.faulty, 0);
  EXPECT_TRUE(std::isnan(one.added_ate_m.median));
}

TEST(TrialSummary, RunsThatAreNotJudgedDoNotCount) {
  TrialRecord record = exampleTrial();
  for (TrialRun& run : record.results) {
    if (run.fault == "dark") {
      run.status = kStatusFaultNotMet;
    } else if (run.recording == "a") {
      run.status = kStatusNotJudged;
      run.causal.ate_m = WindowErrors::kNone;
    }
  }
  const TrialSummary all = summaryOf(record, [](const TrialRun&) { return true; });
  EXPECT_EQ(all.survived, 4);
  EXPECT_EQ(all.runs, 4);
  EXPECT_EQ(all.not_judged, 4);
  EXPECT_EQ(all.not_met, 8);
  EXPECT_TRUE(failuresOf(record).empty());
  record.sequences[1].has_ground_truth = true;
  EXPECT_EQ(describeUncounted(record)[0],
            "a: there is no ground truth; 4 of 4 runs are not judged");
  record.sequences[0].has_ground_truth = true;
  EXPECT_EQ(describeUncounted(record)[0],
            "a: ground truth covers 0 of 4 runs, each by 50 % of its poses; 4 of 4 runs are not "
            "judged; is it on the same clock?");
  EXPECT_EQ(describeUncounted(record)[1],
            "fault 'dark': it changes no measurement in 8 of 8 runs, which do not count; does it "
            "lie within them (covered from=5 for=1)?");
}

TEST(TrialSummary, WhatAFaultAddsIsAgainstTheSameRunWithoutIt) {
  const TrialRecord record = exampleTrial();
  const TrialSummary dark =
      summaryOf(record, [](const TrialRun& run) { return run.fault == "dark"; });
  EXPECT_EQ(dark.added_ate_m.count, 8);
  EXPECT_NEAR(dark.added_ate_m.median, 0.0035, 1e-12);  // 3 of `one`, 4 of `two`
  EXPECT_NEAR(dark.largest_added_ate_m, 0.004, 1e-12);
}

TEST(TrialSummary, ErrorsAfterTheStartAreThoseWithoutAFault) {
  const TrialRecord record = exampleTrial();
  const TrialVariant two = variantsOf(record)[1];
  EXPECT_NEAR(afterStart(record, two, 5.0, &ErrorsAfterStart::ate_m).median, 0.0035, 1e-12);
  EXPECT_EQ(afterStart(record, two, 5.0, &ErrorsAfterStart::ate_m).count, 4);
  EXPECT_EQ(afterStart(record, two, 3.0, &ErrorsAfterStart::ate_m).count, 0);
}

TEST(TrialFailures, OfTheSameKindStandTogether) {
  TrialRecord record = exampleTrial();
  for (const size_t i : {2U, 5U}) {
    record.results[i].status = kStatusFailed;
    record.results[i].reason =
        i == 2 ? "ATE 0.612 m, more than 0.5 m" : "ATE 1.05 m, more than 0.5 m";
  }
  const std::vector<FailureKind> kinds = failuresOf(record);
  ASSERT_EQ(kinds.size(), 2U);
  EXPECT_EQ(kinds[0].reason, "ATE 0.612 m, more than 0.5 m");
  EXPECT_EQ(kinds[0].runs, (std::vector<size_t>{2, 5}));
  EXPECT_EQ(kinds[1].runs, std::vector<size_t>{15});
}

}  // namespace
}  // namespace etalon
