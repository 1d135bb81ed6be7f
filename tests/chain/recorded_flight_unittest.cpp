#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const std::string kMachineHall = ETALON_EUROC_FOLDER "/MH_01_easy_real";
const std::string kViconRoom = ETALON_EUROC_FOLDER "/V1_01_easy_real";

TEST(RecordedFlight, ASecondIsTooShortForTheWindow) {
  const TemporaryFolder folder;
  const CommandResult result = runEtalon({"replay", kViconRoom, "--out", folder.path()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("shorter than the window of keyframes"));
}

class RecordedFlightWith : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Initializers, RecordedFlightWith,
                         ::testing::Values("eta", "orbslam3_inertial_only"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(RecordedFlightWith, InitialisesAtOnceAsAccuratelyAsThisFlightAllows) {
  const TemporaryFolder folder;
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"0", "2.5"}, {"2", "4.5"}}) {  // a window of 2.25 s, and some frames more
    const CommandResult result = runEtalon({"replay", kMachineHall, "--initializer", GetParam(),
                                            "--from", from, "--to", to, "--out", folder.path()});
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    const json run = readJson(folder.path() + "/initialization.json");
    EXPECT_EQ(run.at("attempts").size(), 1U);
    // Single windows: about twice the medians that windows of this flight reach.
    const json errors = errorsAfterViBa(acceptedAttempt(run));
    EXPECT_LT(errors.at("rre_deg").get<double>(), 0.03);
    EXPECT_LT(errors.at("velocity_mps").get<double>(), 0.02);
    EXPECT_LT(errors.at("gravity_deg").get<double>(), 1.0);
  }
}

TEST(RecordedFlight, TheRawlogsCutStampsDoNotShow) {
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
  EXPECT_LE(largestDistance(trajectories[0], trajectories[1]), 1e-6);
}

}  // namespace
}  // namespace etalon::testing
