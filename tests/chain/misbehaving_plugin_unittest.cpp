// A plugin that crashes, exits or does not come back loses its own window or attempt and nothing
// else, and the user is told which.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kTracks = ETALON_RENDERED "/tracks";

struct Misdeed {
  const char* how;     ///< [misbehaves] how
  const char* status;  ///< of the window
  const char* words;   ///< what is said of it
};
constexpr Misdeed kMisdeeds[] = {
    {"segfault", "crashed", "crashed with signal 11 (Segmentation fault)"},
    {"abort", "crashed", "crashed with signal 6 (Aborted)"},
    {"exit", "crashed", "ended the process with exit code 0"},
    {"loop", "time_limit", "used more than 1 s of processor time"},
    {"wait", "time_limit", "waited for 1 s without using the processor"}};

class MisbehavingPlugin : public ::testing::TestWithParam<Misdeed> {
 protected:
  std::string out(const std::string& name) const { return folder_.path() + "/" + name; }

  /** Windows 2 and 3 of the flight, which begin 1.1 and 1.6 s after 1400000000 s, are misbehaved
   * at.
   */
  CommandResult bench(const std::string& name, const std::string& how,
                      const std::string& jobs) const {
    return runEtalon({"bench",          kFlight,
                      "--plugin-path",  ETALON_MISBEHAVES,
                      "--initializers", "static,misbehaves,eta",
                      "--every",        "0.5",
                      "--keyframes",    "4",
                      "--tracks",       kTracks,
                      "--jobs",         jobs,
                      "--time-limit",   "1",
                      "--set",          "misbehaves.how=" + how,
                      "--set",          "misbehaves.begin_s=1400000001",
                      "--set",          "misbehaves.end_s=1400000001.7",
                      "--out",          out(name)});
  }

  TemporaryFolder folder_;
};
INSTANTIATE_TEST_SUITE_P(All, MisbehavingPlugin, ::testing::ValuesIn(kMisdeeds),
                         [](const auto& misdeed) { return std::string(misdeed.param.how); });

/** The rows of windows.csv that hold `text`, without their times. */
std::vector<std::string> rowsWith(const std::string& csv, const std::string& text) {
  std::istringstream lines(csv);
  std::vector<std::string> rows;
  for (std::string line; std::getline(lines, line);)
    if (line.find(text) != std::string::npos) rows.push_back(line.substr(0, line.rfind(',')));
  return rows;
}

TEST_P(MisbehavingPlugin, LosesItsWindowsInABenchmarkAndNothingElse) {
  const Misdeed& misdeed = GetParam();
  const CommandResult result = bench("bad", misdeed.how, "2");
  EXPECT_EQ(result.exit_code, 4) << result.err;
  for (const char* window : {"2", "3"})
    EXPECT_THAT(result.err, HasSubstr(std::string("flight, 4 keyframes at 4 Hz, window ") + window +
                                      ", misbehaves: " + misdeed.words));
  const std::string csv = readText(out("bad") + "/windows.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 7 * 3 * 2);
  EXPECT_EQ(rowsWith(csv, std::string(",") + misdeed.status + ",").size(), 2u * 2u);
  EXPECT_EQ(rowsWith(csv, ",misbehaves,vi_ba,too_little_motion,polite").size(), 5u);

  const CommandResult good = bench("good", "escape", "1");
  EXPECT_EQ(good.exit_code, 0) << good.err;
  const std::string same = readText(out("good") + "/windows.csv");
  for (const char* other : {",eta,", ",static,"})
    EXPECT_EQ(rowsWith(csv, other), rowsWith(same, other));

  // What was lost stays lost: the same would happen again.
  const CommandResult again = bench("bad", misdeed.how, "1");
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.err, AllOf(HasSubstr("21 results (21 were there already)"),
                               HasSubstr("misbehaves: 2 results")));
}

TEST_P(MisbehavingPlugin, EndsAReplayWhichKeepsWhatCameBefore) {
  const Misdeed& misdeed = GetParam();
  // The windows of 4 keyframes at 4 Hz end from 0.75 s on; the one from 1 s on ends at 1.75 s.
  const auto replay = [&](const std::string& name, const std::string& how) {
    return runEtalon({"replay",        kFlight,
                      "--plugin-path", ETALON_MISBEHAVES,
                      "--initializer", "misbehaves",
                      "--set",         "pipeline.keyframes=4",
                      "--set",         "pipeline.min_keyframes=4",
                      "--set",         "misbehaves.how=" + how,
                      "--set",         "misbehaves.begin_s=1400000001",
                      "--time-limit",  "1",
                      "--to",          "2.5",
                      "--out",         out(name)});
  };
  const CommandResult result = replay("bad", misdeed.how);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_THAT(
      result.err,
      AllOf(HasSubstr(std::string("etalon: misbehaves ") + misdeed.words + " at "),
            HasSubstr(std::string(" s of ") + kFlight), HasSubstr("in its attempt number 5")));
  const auto run = readJson(out("bad") + "/initialization.json");
  ASSERT_EQ(run.at("attempts").size(), 5u);
  EXPECT_EQ(run.at("attempts").at(3).at("reason"), "polite");
  EXPECT_EQ(run.at("attempts").at(4).at("status"), misdeed.status);
  EXPECT_EQ(run.at("attempts").at(4).at("reason"), misdeed.words);
  EXPECT_THAT(runEtalon({"compare", out("bad")}).out, HasSubstr(misdeed.words));

  const CommandResult good = replay("good", "escape");
  EXPECT_EQ(good.exit_code, 1) << good.err;
  const std::string whole = readText(out("good") + "/trajectory.tum");
  const std::string before = readText(out("bad") + "/trajectory.tum");
  EXPECT_GT(before.size(), 1000u);
  EXPECT_EQ(whole.substr(0, before.size()), before);
}

TEST_P(MisbehavingPlugin, EndsACalibrationWithoutADeviceFile) {
  const Misdeed& misdeed = GetParam();
  const CommandResult result = runEtalon(
      {"calibrate-device", kFlight, "--tracks", kTracks, "--plugin-path", ETALON_MISBEHAVES,
       "--initializer", "misbehaves", "--set", std::string("misbehaves.how=") + misdeed.how,
       "--set", "misbehaves.begin_s=1400000001", "--time-limit", "1", "--out", out("device.ini")});
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr(std::string("etalon: misbehaves ") + misdeed.words),
                                HasSubstr("no device file was written")));
  EXPECT_FALSE(std::filesystem::exists(out("device.ini")));
}

TEST(PluginThatCrashesWhenMade, IsNamedByABenchmark) {
  const TemporaryFolder folder;
  for (const char* initializers : {"static,crashes_when_made", "all"}) {
    const CommandResult result =
        runEtalon({"bench", kFlight, "--plugin-path", ETALON_CRASHES_WHEN_MADE, "--initializers",
                   initializers, "--out", folder.path() + "/out"});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err,
                HasSubstr("crashed with signal 11 (Segmentation fault) while it was loaded"));
    if (initializers != std::string("all")) {
      EXPECT_THAT(result.err, HasSubstr("initializer 'crashes_when_made'"));
    }
  }
}

TEST(PluginsWords, ReachNeitherTerminalNorReportAsTheyAre) {
  const TemporaryFolder folder;
  const CommandResult result =
      runEtalon({"replay", kFlight, "--plugin-path", ETALON_MISBEHAVES, "--initializer",
                 "misbehaves", "--set", "pipeline.keyframes=4", "--set", "misbehaves.how=escape",
                 "--to", "1.5", "--out", folder.path() + "/run"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("because \\x1b[31mred"), Not(HasSubstr("\x1b"))));
  EXPECT_THAT(readText(folder.path() + "/run/report.html"),
              AllOf(HasSubstr("x1b[31mred"), Not(HasSubstr("\x1b")), Not(HasSubstr("u001b")),
                    Not(HasSubstr("<b>alarm"))));
  EXPECT_THAT(runEtalon({"plugins", "--plugin-path", ETALON_MISBEHAVES}).out,
              AllOf(HasSubstr("does \\x1b[31mwhat"), Not(HasSubstr("\x1b"))));
}

}  // namespace
}  // namespace etalon::testing
