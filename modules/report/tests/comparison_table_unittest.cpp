#include "etalon/report/comparison_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using testing::exampleRecord;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Comparison, OneRowAStage) {
  const Table table = compareRuns({{"out/a", exampleRecord()}});
  ASSERT_EQ(table.rowCount(), 2u);
  EXPECT_EQ(table.textAt(0, "run"), "out/a");
  EXPECT_NEAR(table.numberAt(0, "initialized_at_s"), 0.500000001, 1e-12);  // a difference of stamps
  EXPECT_EQ(table.numberAt(0, "attempts"), 2);
  EXPECT_EQ(table.textAt(0, "status"), "success");
  EXPECT_EQ(table.textAt(0, "stage"), "init");
  EXPECT_NEAR(table.numberAt(0, "rre_deg"), 0.0123 * 1.1, 1e-12);
  EXPECT_EQ(table.numberAt(0, "ms"), 15.75);  // with 12.5 of stereo odometry
  EXPECT_EQ(table.textAt(1, "stage"), "vi_ba");
  EXPECT_NEAR(table.numberAt(1, "gravity_deg"), 0.789 * 0.7, 1e-9);  // nine digits
  EXPECT_EQ(table.numberAt(1, "ms"), 30);
  EXPECT_TRUE(std::isnan(table.numberAt(1, "scale_error")));
  EXPECT_EQ(table.numberAt(1, "trajectory_ate_m"), 0.01);
}

TEST(Comparison, RunsThatNeverInitializedSayWhy) {
  RunRecord refused = exampleRecord();
  refused.attempts.resize(1);
  refused.initialized_at.reset();
  RunRecord never = refused;
  never.attempts.clear();
  const std::vector<std::pair<std::string, RunRecord>> runs = {
      {"a", exampleRecord()}, {"b", refused}, {"c", never}};
  const Table table = compareRuns(runs);
  ASSERT_EQ(table.rowCount(), 4u);
  EXPECT_EQ(table.textAt(2, "status"), "too_few_tracks");
  EXPECT_TRUE(std::isnan(table.numberAt(2, "initialized_at_s")));
  EXPECT_EQ(table.textAt(2, "stage"), "");
  EXPECT_EQ(table.textAt(3, "status"), "no attempt");
  const std::string text = compareRuns(runs).toString(TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("status"));
  EXPECT_THAT(text, Not(HasSubstr("source")));  // the same for all of them
  const std::vector<std::string> sentences = refusalsOf(runs);
  ASSERT_EQ(sentences.size(), 2u);
  EXPECT_THAT(sentences[0], HasSubstr("b: never initialized; 1 attempt, the last one: "
                                      "too_few_tracks, 12 landmarks, at least 30"));
  EXPECT_THAT(sentences[1], HasSubstr("the window of keyframes was never full"));
}

TEST(Comparison, SourcesStandInTheTextWhereTheyDiffer) {
  RunRecord other = exampleRecord();
  other.source = "/data/MH_01_easy/";
  const std::string text =
      compareRuns({{"a", exampleRecord()}, {"b", other}}).toString(TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("MH_01_easy"));
  EXPECT_THAT(text, Not(HasSubstr("/data")));
  EXPECT_THAT(text, Not(HasSubstr("status")));  // all succeeded
  // CSV has every column.
  const std::string csv = compareRuns({{"a", exampleRecord()}}).toString(TableFormat::kCsv);
  EXPECT_THAT(csv, HasSubstr("run,source,initializer,"));
}

TEST(Comparison, OfARunThatNeverInitializedTheLastAttemptWithAStageIsShown) {
  RunRecord run = exampleRecord();
  AttemptRecord implausible = run.attempts[1];
  implausible.status = "implausible";
  AttemptRecord later = run.attempts[0];
  later.status = "imu_gap";
  run.attempts = {run.attempts[0], implausible, later};
  const Table table = compareRuns({{"a", run}});
  ASSERT_EQ(table.rowCount(), 2U);
  EXPECT_EQ(table.textAt(0, "status"), "implausible");
  EXPECT_EQ(table.numberAt(0, "attempts"), 3.0);
  EXPECT_EQ(table.textAt(1, "stage"), "vi_ba");
  // The sentence is about the last one, whatever it reached.
  const std::vector<std::string> sentences = refusalsOf({{"a", run}});
  ASSERT_EQ(sentences.size(), 1U);
  EXPECT_THAT(sentences[0], HasSubstr("3 attempts, the last one: imu_gap"));
}

TEST(Comparison, AStageWithoutGroundTruthHasItsTimeAlone) {
  RunRecord run = exampleRecord();
  run.trajectory_errors.reset();
  for (StageRecord& stage : run.attempts[1].stages) stage.errors.reset();
  const Table table = compareRuns({{"a", run}});
  EXPECT_EQ(table.numberAt(0, "ms"), 15.75);  // with 12.5 of stereo odometry
  for (const char* key : {"rre_deg", "ate_m", "gravity_deg", "velocity_mps", "trajectory_ate_m"})
    EXPECT_EQ(table.textAt(0, key), "") << key;
}

TEST(Comparison, BrieflyARowARunWithTheStagesBesideEachOther) {
  const Table table = compareRunsBriefly({{"out/a", exampleRecord()}});
  ASSERT_EQ(table.rowCount(), 1u);
  EXPECT_EQ(table.textAt(0, "initializer"), exampleRecord().initializer);
  EXPECT_NEAR(table.numberAt(0, "rre_deginit"), 0.0123 * 1.1, 1e-12);
  EXPECT_EQ(table.numberAt(0, "msinit"), 15.75);
  EXPECT_NEAR(table.numberAt(0, "gravity_degvi_ba"), 0.789 * 0.7, 1e-9);
  EXPECT_EQ(table.numberAt(0, "trajectory_ate_m"), 0.01);
  // A run of its initializer's name needs no other.
  EXPECT_FALSE(compareRunsBriefly({{exampleRecord().initializer, exampleRecord()}})
                   .hasColumn("initializer"));
}

}  // namespace
}  // namespace etalon
