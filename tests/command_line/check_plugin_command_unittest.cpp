#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string badPlugin(const std::string& name) { return ETALON_BAD_PLUGINS "/" + name + ".so"; }

TEST(CheckPluginCommand, PassesOnePlugin) {
  const CommandResult result =
      runEtalon({"check-plugin", "orbslam3_inertial_only", "--only", "exact.", "--only", "needs"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("passed   needs"), HasSubstr("exact.standstill"),
                                HasSubstr("8 passed"), HasSubstr("0 failed")));
}

TEST(CheckPluginCommand, SpeaksJson) {
  const CommandResult result = runEtalon({"check-plugin", "orbslam3_inertial_only", "--only",
                                          "exact.gentle", "--only", "time", "--format", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("plugin"), "orbslam3_inertial_only");
  EXPECT_EQ(json.at("ok"), true);
  EXPECT_GT(json.at("milliseconds_per_call").get<double>(), 0.0);
  EXPECT_EQ(json.at("checks").at(1).at("name"), "exact.gentle");
  EXPECT_EQ(json.at("checks").at(1).at("verdict"), "passed");
}

TEST(CheckPluginCommand, ChecksWithOtherParameters) {
  const CommandResult result = runEtalon({"check-plugin", "orbslam3_inertial_only", "--only",
                                          "exact.gentle", "--set", "min_landmarks=100000"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("refused  exact.gentle"));
  const CommandResult no_value =
      runEtalon({"check-plugin", "orbslam3_inertial_only", "--set", "min_landmarks"});
  EXPECT_EQ(no_value.exit_code, 2);
  EXPECT_THAT(no_value.err, HasSubstr("'min_landmarks': expected key=value"));
  const CommandResult unknown =
      runEtalon({"check-plugin", "orbslam3_inertial_only", "--set", "min_landmark=1"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("min_landmarks"));
}

TEST(CheckPluginCommand, RefusesAFileThatLeavesTheDefaults) {
  const TemporaryFolder temporary;
  const auto checkWith = [&](const std::string& ini) {
    return runEtalon({"check-plugin", "orbslam3_inertial_only", "--only", "exact.gentle",
                      "--config", temporary.write("plugin.ini", ini)});
  };
  const std::string values = "min_landmarks = 100000\n";
  const CommandResult typo = checkWith("[orbslam_inertial_only]\n" + values);
  EXPECT_EQ(typo.exit_code, 2);
  EXPECT_THAT(typo.err, AllOf(HasSubstr("expected a section [orbslam3_inertial_only]"),
                              HasSubstr("is [orbslam_inertial_only] meant?")));
  EXPECT_EQ(checkWith("[pipeline]\nkeyframes = 12\n").exit_code, 2);
  const CommandResult other = checkWith("[orbslam3_inertial_only]\n[pipelin]\n");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("did you mean 'pipeline'?"));
  const CommandResult good =
      checkWith("[pipeline]\nkeyframes = 12\n[orbslam3_inertial_only]\n" + values);
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("refused  exact.gentle"));
}

TEST(CheckPluginCommand, ShowsTheWorstWindowAndAllOfThemInJson) {
  const std::vector<std::string> arguments = {"check-plugin", badPlugin("crashes_when_asked"),
                                              "--only",       "response.gyro_bias",
                                              "--set",        "politely=true"};
  EXPECT_THAT(
      runEtalon(arguments).out,
      HasSubstr("gentle: refuses (invalid_input) without a reason; 11 more windows failed"));
  std::vector<std::string> in_json = arguments;
  in_json.insert(in_json.end(), {"--format", "json"});
  const nlohmann::json json = nlohmann::json::parse(runEtalon(in_json).out);
  EXPECT_EQ(json.at("checks").at(0).at("failures").size(), 12U);
  EXPECT_TRUE(json.at("milliseconds_per_call").is_null());  // nobody asked
  EXPECT_EQ(json.at("stopped"), "");
}

TEST(CheckPluginCommand, SaysTheNeesByMotion) {
  const std::vector<std::string> arguments = {
      "check-plugin", "static", "--only",    "covariance.consistent",
      "--windows",    "10",     "--motions", "gentle,standstill"};
  const CommandResult text = runEtalon(arguments);
  EXPECT_THAT(text.out, AllOf(HasSubstr(" 0 windows, gentle: no covariance\n"),
                              HasSubstr(" 5 windows, standstill: average NEES")));
  std::vector<std::string> in_json = arguments;
  in_json.insert(in_json.end(), {"--format", "json"});
  const nlohmann::json json = nlohmann::json::parse(runEtalon(in_json).out);
  EXPECT_EQ(json.at("checks").at(0).at("by_motion").size(), 2U);
}

TEST(CheckPluginCommand, SurvivesAPluginThatCrashes) {
  const CommandResult asked = runEtalon({"check-plugin", badPlugin("crashes_when_asked"), "--only",
                                         "exact.gentle", "--only", "parameters"});
  EXPECT_EQ(asked.exit_code, 1) << asked.err;
  EXPECT_THAT(asked.out, AllOf(HasSubstr("passed   parameters"), HasSubstr("FAILED   exact.gentle"),
                               HasSubstr("crashed with signal 11")));
  const CommandResult loaded = runEtalon({"check-plugin", badPlugin("crashes_when_loaded")});
  EXPECT_EQ(loaded.exit_code, 3);
  EXPECT_THAT(loaded.err, HasSubstr("while being loaded it crashed with signal 11"));
}

TEST(PluginsCommand, ListsPluginsThatCrashWhenLoadedBesideTheOthers) {
  const CommandResult list =
      runEtalon({"plugins", "--plugin-path", badPlugin("crashes_when_loaded")});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_THAT(list.out, AllOf(HasSubstr("orbslam3_inertial_only "), HasSubstr("Not usable"),
                              HasSubstr("crashes_when_loaded.so"),
                              HasSubstr("while being loaded it crashed with signal 11")));
  // By name and by path, the code is that of check-plugin.
  for (const std::string& name :
       {std::string("crashes_when_loaded"), badPlugin("crashes_when_loaded")}) {
    const CommandResult described = runEtalon(
        {"plugins", "--plugin-path", badPlugin("crashes_when_loaded"), "--describe", name});
    EXPECT_EQ(described.exit_code, 3) << name;
    EXPECT_THAT(described.err, HasSubstr("crashed with signal 11"));
  }
}

TEST(CheckPluginCommand, RefusesWhatCannotBeLoadedInWords) {
  const CommandResult missing = runEtalon({"check-plugin", "/no/such/plugin.so"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("no such file"));
  const CommandResult name = runEtalon({"check-plugin", "etta"});
  EXPECT_EQ(name.exit_code, 3);
  EXPECT_THAT(name.err, HasSubstr("etta"));
  const TemporaryFolder temporary;
  const std::string text = temporary.write("text.so", "not a library\n");
  EXPECT_EQ(runEtalon({"check-plugin", text}).exit_code, 3);
}

TEST(CheckPluginCommand, RefusesWrongUsage) {
  EXPECT_EQ(runEtalon({"check-plugin"}).exit_code, 2);
  EXPECT_EQ(runEtalon({"check-plugin", "eta", "--allow-nees", "0.5"}).exit_code, 2);
  EXPECT_EQ(runEtalon({"check-plugin", "eta", "--format", "xml"}).exit_code, 2);
  EXPECT_EQ(runEtalon({"check-plugin", "eta", "--motions", "circular"}).exit_code, 2);
  EXPECT_EQ(runEtalon({"check-plugin", "eta", "--time-limit", "0"}).exit_code, 2);
  const CommandResult check =
      runEtalon({"check-plugin", "orbslam3_inertial_only", "--only", "exact.gentel"});
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_THAT(check.err, HasSubstr("did you mean 'exact.gentle'?"));
}

TEST(CheckPluginCommand, ListsTheChecks) {
  const CommandResult result = runEtalon({"check-plugin", "--list"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("covariance.consistent"), HasSubstr("exact.gentle"),
                                HasSubstr("status.outliers")));
}

TEST(CheckPluginCommand, ListsEveryCheckAndNamesTheGroup) {
  EXPECT_THAT(runEtalon({"check-plugin", "--list"}).out, HasSubstr("\nexact.somewhere "));
  for (const char* name : {"exact", "exact.somewhere"})
    EXPECT_THAT(runEtalon({"check-plugin", "eta", "--only", name}).err,
                HasSubstr("did you mean 'exact.'?"));
}

}  // namespace
}  // namespace etalon::testing
