#include "etalon/report/comparison_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using testing::exampleRecord;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Comparison, OneRowAStage) {
  const auto json =
      nlohmann::json::parse(compareRuns({{"out/a", exampleRecord()}}).toString(TableFormat::kJson));
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["run"], "out/a");
  EXPECT_EQ(json[0]["initialized_at_s"], 0.500000001);
  EXPECT_EQ(json[0]["attempts"], 2);
  EXPECT_EQ(json[0]["status"], "success");
  EXPECT_EQ(json[0]["stage"], "init");
  EXPECT_NEAR(json[0]["rre_deg"], 0.0123 * 1.1, 1e-12);
  EXPECT_EQ(json[0]["ms"], 3.25);
  EXPECT_EQ(json[1]["stage"], "vi_ba");
  EXPECT_NEAR(json[1]["gravity_deg"], 0.789 * 0.7, 1e-9);  // nine digits
  EXPECT_EQ(json[1]["ms"], 30);
  EXPECT_TRUE(json[1]["scale_error"].is_null());
  EXPECT_EQ(json[1]["trajectory_ate_m"], 0.01);
}

TEST(Comparison, RunsThatNeverInitialisedSayWhy) {
  RunRecord refused = exampleRecord();
  refused.attempts.resize(1);
  refused.initialized_at.reset();
  RunRecord never = refused;
  never.attempts.clear();
  const std::vector<std::pair<std::string, RunRecord>> runs = {
      {"a", exampleRecord()}, {"b", refused}, {"c", never}};
  const auto json = nlohmann::json::parse(compareRuns(runs).toString(TableFormat::kJson));
  ASSERT_EQ(json.size(), 4u);
  EXPECT_EQ(json[2]["status"], "too_few_tracks");
  EXPECT_TRUE(json[2]["initialized_at_s"].is_null());
  EXPECT_TRUE(json[2]["stage"].is_null());
  EXPECT_EQ(json[3]["status"], "no attempt");
  const std::string text = compareRuns(runs).toString(TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("status"));
  EXPECT_THAT(text, Not(HasSubstr("source")));  // the same for all of them
  const std::vector<std::string> sentences = refusalsOf(runs);
  ASSERT_EQ(sentences.size(), 2u);
  EXPECT_THAT(sentences[0], HasSubstr("b: never initialised; 1 attempt, the last one: "
                                      "too_few_tracks, 12 landmarks, at least 30"));
  EXPECT_THAT(sentences[1], HasSubstr("the window of keyframes was never full"));
}

}  // namespace
}  // namespace etalon
