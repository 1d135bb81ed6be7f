#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/report/report.h"
#include "etalon/report/trial_tables.h"
#include "etalon/testing/example_trial.h"
#include "etalon/testing/temporary_folder.h"
#include "page_data.h"

namespace etalon {
namespace {

using nlohmann::json;
using testing::dataOf;
using testing::exampleTrial;
using ::testing::HasSubstr;

class TrialReportTest : public ::testing::Test {
 protected:
  static void write(const std::string& path, const Trajectory& trajectory) {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    writeTum(path, trajectory);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(TrialReportTest, HoldsEveryRunWithItsReason) {
  const TrialRecord record = exampleTrial();
  const std::string page = trialReportHtml(record, folder_.path());
  const json data = dataOf(page);
  EXPECT_EQ(data.at("variants"), (json{"one", "two"}));
  EXPECT_EQ(data.at("faults"), (json{"none", "dark"}));
  EXPECT_EQ(data.at("parts").size(), 4U);
  ASSERT_EQ(data.at("runs").size(), 16U);
  const json& last = data.at("runs").back();
  EXPECT_EQ(last[0], 3);
  EXPECT_EQ(last[1], 1);
  EXPECT_EQ(last[3], "failed");
  EXPECT_THAT(last[5].get<std::string>(), HasSubstr("silent"));
  EXPECT_TRUE(last[7].is_null());  // there is no trajectory
  EXPECT_THAT(page, HasSubstr("15 of 16 survived, 1 wrong without a word"));
}

TEST_F(TrialReportTest, AlignsTrajectoriesWithGroundTruth) {
  const TrialRecord record = exampleTrial();
  const TrialRun& run = record.results.front();
  Trajectory truth, flown;
  for (int k = 0; k < 50; ++k) {
    const double s = 0.05 * k;
    truth.push_back({durationNs(s), {Eigen::Matrix3d::Identity(), {s, s * s, 0.0}}});
    flown.push_back({durationNs(s), {Eigen::Matrix3d::Identity(), {7.0 + s, s * s, 3.0}}});
  }
  write(groundTruthPath(folder_.path(), run.recording, run.from_s), truth);
  write(trajectoryPath(folder_.path(), record, run), flown);
  const json data = dataOf(trialReportHtml(record, folder_.path()));
  const json& path = data.at("runs")[0][7];
  ASSERT_EQ(path.size(), 10U);  // every fifth
  EXPECT_NEAR(path[4][0].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(path[4][1].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(path[4][2].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(path[4][3].get<double>(), 0.0, 1e-6);
  EXPECT_EQ(data.at("parts")[0].at("truth").size(), 10U);
}

TEST_F(TrialReportTest, ErrorsAreThoseAfterTheAlignment) {
  const TrialRecord record = exampleTrial();
  const TrialRun& run = record.results.front();
  Trajectory truth, flown;
  for (int k = 0; k < 100; ++k) {
    const double s = 0.05 * k;
    truth.push_back({durationNs(s), {Eigen::Matrix3d::Identity(), {std::cos(s), std::sin(s), s}}});
    flown.push_back(truth.back());
    flown.back().T_WB.t.z() += k < 50 ? -0.1 : 0.1;  // no yaw and position can mend that
  }
  write(groundTruthPath(folder_.path(), run.recording, run.from_s), truth);
  write(trajectoryPath(folder_.path(), record, run), flown);
  const json data = dataOf(trialReportHtml(record, folder_.path()));
  for (const json& point : data.at("runs")[0][7])
    EXPECT_NEAR(point[3].get<double>(), 0.1, 1e-6) << point[0];
}

TEST_F(TrialReportTest, WithoutGroundTruthTrajectoriesAreDrawnAsTheyAre) {
  const TrialRecord record = exampleTrial();
  const TrialRun& run = record.results.front();
  Trajectory flown;
  for (int k = 0; k < 20; ++k)
    flown.push_back({durationNs(0.05 * k), {Eigen::Matrix3d::Identity(), {7.0, 0.1 * k, 3.0}}});
  write(trajectoryPath(folder_.path(), record, run), flown);
  const json data = dataOf(trialReportHtml(record, folder_.path()));
  const json& path = data.at("runs")[0][7];
  ASSERT_EQ(path.size(), 4U);
  EXPECT_EQ(path[1][1], 7.0);
  EXPECT_NEAR(path[1][2].get<double>(), 0.5, 1e-9);
  EXPECT_TRUE(path[1][3].is_null());
  EXPECT_TRUE(data.at("parts")[0].at("truth").empty());
}

TEST_F(TrialReportTest, AFaultMayMoveStampsAwayFromTheGroundTruth) {
  const TrialRecord record = exampleTrial();
  const TrialRun& run = record.results[1];  // with the fault
  Trajectory truth, flown;
  for (int k = 0; k < 40; ++k) {
    const double s = 0.05 * k;
    truth.push_back({durationNs(s), {Eigen::Matrix3d::Identity(), {s, s * s, 0.0}}});
    // From the middle on the clock is five seconds ahead.
    flown.push_back({durationNs(k < 20 ? s : s + 5.0), truth.back().T_WB});
  }
  write(groundTruthPath(folder_.path(), run.recording, run.from_s), truth);
  write(trajectoryPath(folder_.path(), record, run), flown);
  const json data = dataOf(trialReportHtml(record, folder_.path()));
  const json& path = data.at("runs")[1][7];
  ASSERT_EQ(path.size(), 8U);
  EXPECT_NEAR(path[2][3].get<double>(), 0.0, 1e-6);
  EXPECT_TRUE(path[6][3].is_null());
}

TEST_F(TrialReportTest, ManyPosesAreThinnedOut) {
  TrialRecord record = exampleTrial();
  for (TrialRun& run : record.results) run.poses = 100'000;  // 1.6 million in all: every 17th
  const TrialRun& run = record.results.front();
  Trajectory flown;
  for (int k = 0; k < 170; ++k)
    flown.push_back({durationNs(0.05 * k), {Eigen::Matrix3d::Identity(), {0.1 * k, 0.0, 0.0}}});
  write(trajectoryPath(folder_.path(), record, run), flown);
  const json data = dataOf(trialReportHtml(record, folder_.path()));
  EXPECT_EQ(data.at("runs")[0][7].size(), 10U);
}

TEST_F(TrialReportTest, ErrorsAfterTheStartAreByVariantAndTime) {
  const json data = dataOf(trialReportHtml(exampleTrial(), folder_.path()));
  const json& after = data.at("after_start");
  EXPECT_EQ(after.at("times"), (json{1.0, 5.0, 10.0, 0.0}));
  ASSERT_EQ(after.at("ate_m").size(), 2U);
  EXPECT_NEAR(after.at("ate_m")[1][2].get<double>(), 0.0035, 1e-9);
}

TEST_F(TrialReportTest, NamesAreSafeInAPage) {
  TrialRecord record = exampleTrial();
  record.faults[1].name = "<b>dark</b>";
  record.faults[1].text = "covered & more";
  record.sequences[1].error = "'x' < 3";
  for (TrialRun& run : record.results)
    if (run.fault != kNoFault) run.fault = record.faults[1].name;
  const std::string page = trialReportHtml(record, folder_.path());
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;dark&lt;/b&gt;"));
  EXPECT_THAT(page, ::testing::Not(HasSubstr("<b>dark</b>")));
  EXPECT_THAT(page, HasSubstr("covered &amp; more"));
  EXPECT_THAT(page, HasSubstr("'x' &lt; 3"));
}

TEST_F(TrialReportTest, EveryTableIsInIt) {
  const std::string page = trialReportHtml(exampleTrial(), folder_.path());
  for (const TitledTable& table : trialTables(exampleTrial()))
    EXPECT_THAT(page, HasSubstr("<h3>" + table.title)) << table.id;
  EXPECT_THAT(page, HasSubstr("[pipeline]"));  // the configuration
}

}  // namespace
}  // namespace etalon
