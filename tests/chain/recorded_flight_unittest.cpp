#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "chain_files.h"
#include "etalon/core/statistics.h"

namespace etalon::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const std::string kMachineHall = ETALON_EUROC_FOLDER "/MH_01_easy_real";
const std::string kViconRoom = ETALON_EUROC_FOLDER "/V1_01_easy_real";

TEST(RecordedFlight, ASecondIsEnoughAtRest) {
  const TemporaryFolder folder;
  const CommandResult result = runEtalon({"replay", kViconRoom, "--out", folder.path()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const json run = readJson(folder.path() + "/initialization.json");
  EXPECT_EQ(run.at("initializer"), "etalon");
  EXPECT_EQ(run.at("attempts").size(), 2U);  // the second confirms the first
  const json errors = errorsAfterViBa(acceptedAttempt(run));
  // b_a, 0.1 m/s^2, is not told from tilt at rest: 0.58 deg is 1 sigma.
  EXPECT_LE(errors.at("gravity_deg").get<double>(), 1.0);
  EXPECT_LE(errors.at("velocity_mps").get<double>(), 0.01);
}

TEST(RecordedFlight, LessThanTheFirstWindowIsTooShort) {
  const TemporaryFolder folder;
  const CommandResult result =
      runEtalon({"replay", kViconRoom, "--to", "0.4", "--out", folder.path()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("shorter than the window of keyframes"));
}

class RecordedFlightWith : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Initializers, RecordedFlightWith,
                         ::testing::Values("eta", "orbslam3_inertial_only"),
                         [](const auto& test) { return std::string(test.param); });

/** Errors of one stage at several starts. */
struct Errors {
  std::vector<double> rre_deg, ate_m, velocity_mps, gravity_deg;

  void add(const json& attempt, const std::string& name) {
    for (const json& stage : attempt.at("stages")) {
      if (stage.at("stage") != name) continue;
      const json& errors = stage.at("errors");
      rre_deg.push_back(errors.at("rre_deg").get<double>());
      ate_m.push_back(errors.at("ate_m").get<double>());
      velocity_mps.push_back(errors.at("velocity_mps").get<double>());
      gravity_deg.push_back(errors.at("gravity_deg").get<double>());
    }
  }
};

TEST_P(RecordedFlightWith, InitializesAtOnceAsAccuratelyAsThisFlightAllows) {
  const TemporaryFolder folder;
  Errors before, after;
  for (int from = 0; from < 5; ++from) {
    // A window of 2.25 s, and some frames more.
    const CommandResult result = runEtalon(
        {"replay", kMachineHall, "--initializer", GetParam(), "--from", std::to_string(from),
         "--to", std::to_string(from + 2.5), "--set", "pipeline.min_keyframes=10", "--out",
         folder.path() + "/" + std::to_string(from)});
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    const json run = readJson(folder.path() + "/" + std::to_string(from) + "/initialization.json");
    EXPECT_EQ(run.at("attempts").size(), 1U);
    before.add(acceptedAttempt(run), "init");
    after.add(acceptedAttempt(run), "vi_ba");
  }
  ASSERT_EQ(after.rre_deg.size(), 5U);
  // Rotations by the gyro; the other one keeps those of stereo odometry (0.031).
  if (std::string(GetParam()) == "eta") {
    EXPECT_LE(median(before.rre_deg), 0.03);
  }
  EXPECT_LE(median(after.rre_deg), 0.018);
  EXPECT_LE(median(after.ate_m), 0.0025);  // the ground truth's own limit (docs/noise.md)
  EXPECT_LE(median(after.velocity_mps), 0.009);
  EXPECT_LE(median(after.gravity_deg), 0.8);
}

TEST(RecordedFlight, TheRawlogsTicksDoNotShow) {
  const TemporaryFolder folder;
  const std::string log = folder.path() + "/flight.rawlog";
  ASSERT_EQ(runEtalon({"convert", kMachineHall, log}).exit_code, 0);
  std::vector<std::vector<TumLine>> trajectories;
  for (const std::string& source : {kMachineHall, log}) {
    const std::string out = folder.path() + "/run";
    const CommandResult result =
        runEtalon({"replay", source, "--from", "1", "--to", "4", "--out", out});
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    trajectories.push_back(readTum(out + "/trajectory.tum"));
  }
  EXPECT_EQ(largestDistance(trajectories[0], trajectories[1]), 0.0);
}

}  // namespace
}  // namespace etalon::testing
