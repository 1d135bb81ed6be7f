// A flight that is lost for a while goes back to where it was.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using nlohmann::json;

/** The run of ten seconds with lenses covered for two and a half, in which it is lost. */
json runWith(const std::vector<std::string>& more,
             const std::string& fault = "covered from=4 for=2.5") {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = {
      "replay", ETALON_RENDERED "/ten_seconds_aggressive", "--fault", fault,
      "--set",  "odometry.max_dead_reckoning_s=0.3",       "--out",   folder.path()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const CommandResult result = runEtalon(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  return readJson(folder.path() + "/initialization.json");
}

double positionError(const json& run, const std::string& trajectory) {
  return run.at(trajectory + "_errors").at("position_m").at("rmse").get<double>();
}

TEST(Relocalization, AFlightThatWasLostGoesBackToWhereItWas) {
  const json run = runWith({"--final-ba"});
  std::vector<json> jumps;
  for (const json& event : run.at("events"))
    if (event.contains("jump")) jumps.push_back(event);
  ASSERT_GE(jumps.size(), 2U);
  EXPECT_FALSE(jumps[0].at("remark").get<bool>());  // the new start
  EXPECT_TRUE(jumps[1].at("remark").get<bool>());
  EXPECT_THAT(jumps[1].at("reason").get<std::string>(), ::testing::HasSubstr("is recognized"));
  const json& start = jumps[0].at("jump");
  const json& back = jumps[1].at("jump");
  EXPECT_GT(back.at("translation_m").get<double>(), 1.0);
  EXPECT_LT(back.at("sigma_position_m").get<double>(), 0.1);
  EXPECT_LT(back.at("translation_m").get<double>(),
            4.0 * start.at("sigma_position_m").get<double>());
  // What stays is within the seconds for which it was lost.
  EXPECT_LT(positionError(run, "smoothed_trajectory"), 0.2);
  EXPECT_LT(positionError(run, "final_trajectory"), 0.2);
}

TEST(Relocalization, WithoutItTheFlightStaysWhereDeadReckoningHadIt) {
  const json run = runWith({"--set", "map.relocalize=false"});
  EXPECT_GT(positionError(run, "smoothed_trajectory"), 0.5);
}

TEST(Relocalization, LostAgainBeforeItWasRecognisedItGoesBackToTheFirstWorld) {
  const json run = runWith({}, "covered from=3 for=2.5, covered from=6.3 for=0.6");
  int lost = 0;
  for (const json& event : run.at("events"))
    lost += event.at("state") == "lost" && !event.at("remark").get<bool>();
  EXPECT_EQ(lost, 2);
  // Between the losses the flight was metres off; a place of that world would move it by nothing.
  std::vector<double> moved;
  for (const json& event : run.at("events"))
    if (event.at("reason").get<std::string>().find("is recognized") != std::string::npos)
      moved.push_back(event.at("jump").at("translation_m"));
  ASSERT_FALSE(moved.empty());
  EXPECT_GT(moved.front(), 1.0);
}

}  // namespace
}  // namespace etalon::testing
