#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/report/report.h"
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

}  // namespace
}  // namespace etalon
