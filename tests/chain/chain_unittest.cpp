#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kFilesOfARun[][24] = {"trajectory.tum",      "trajectory_smoothed.tum",
                                     "initialization.json", "run.rawlog",
                                     "trajectory.png",      "report.html",
                                     "config.ini"};

/** Replays in motion, with success, and returns the trajectory. */
std::vector<TumLine> replayed(const std::string& source, const std::string& initializer,
                              const std::string& out) {
  const CommandResult result = runEtalon(
      {"replay", source, "--initializer", initializer, "--from", kInMotion, "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  return readTum(out + "/trajectory.tum");
}

size_t countLines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

TEST(Chain, InfoDescribesTheFlight) {
  const CommandResult text = runEtalon({"info", kFlight});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.err, IsEmpty());
  EXPECT_THAT(text.out, AllOf(HasSubstr("stereo frames  80, 20.00 Hz"), HasSubstr("200.00 Hz"),
                              HasSubstr("velocity: yes, biases: yes"), HasSubstr("0 gaps"),
                              HasSubstr("warnings       none")));
  const CommandResult result = runEtalon({"info", kFlight, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const json info = json::parse(result.out);
  EXPECT_EQ(info.at("kind"), "euroc");
  EXPECT_EQ(info.at("stereo").at("count"), 80);
  EXPECT_NEAR(info.at("calibration").at("baseline_m").get<double>(), 0.11, 1e-3);  // EuRoC's rig
}

TEST(Chain, RawlogsHoldWhatTheFolderHolds) {
  const TemporaryFolder folder;
  const json original = json::parse(runEtalon({"info", kFlight, "--json"}).out);
  for (const bool embed : {false, true}) {
    const std::string log = folder.path() + (embed ? "/embedded.rawlog" : "/external.rawlog");
    std::vector<std::string> arguments = {"convert", kFlight, log};
    if (embed) arguments.emplace_back("--embed");
    const CommandResult converted = runEtalon(arguments);
    ASSERT_EQ(converted.exit_code, 0) << converted.err;
    EXPECT_THAT(converted.out, HasSubstr(embed ? "(embedded)" : "(external images)"));
    const json info = json::parse(runEtalon({"info", log, "--json"}).out);
    EXPECT_EQ(info.at("kind"), "rawlog");
    for (const char* key : {"stereo", "imu", "ground_truth", "calibration"})
      EXPECT_EQ(info.at(key), original.at(key)) << key;
    // 80 pairs of 752 x 480 bytes are 58 MB; random textures hardly compress below half of it.
    EXPECT_EQ(std::filesystem::file_size(log) > 10'000'000, embed);
  }
}

class ChainWith : public ::testing::TestWithParam<const char*> {
 protected:
  std::string out(const std::string& name) const { return folder_.path() + "/" + name; }
  TemporaryFolder folder_;
};
INSTANTIATE_TEST_SUITE_P(Initializers, ChainWith,
                         ::testing::Values("eta", "orbslam3_inertial_only"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(ChainWith, InitializesInMotionAndWritesItsResults) {
  const std::string run_folder = out("deep/run");
  const std::vector<TumLine> trajectory = replayed(kFlight, GetParam(), run_folder);
  for (const char* name : kFilesOfARun)
    EXPECT_GT(std::filesystem::file_size(run_folder + "/" + name), 0U) << name;

  const json run = readJson(run_folder + "/initialization.json");
  EXPECT_EQ(run.at("initializer"), GetParam());
  EXPECT_THAT(run.at("warnings"), IsEmpty());
  const json attempt = acceptedAttempt(run);
  ASSERT_FALSE(attempt.is_null());
  // The first window has three; the next one confirms it.
  EXPECT_EQ(attempt.at("keyframes_ns").size(), 4U);
  // The success criterion of the evaluation; measured: 0.1 deg and 0.002 m/s.
  const json errors = errorsAfterViBa(attempt);
  EXPECT_LT(errors.at("gravity_deg").get<double>(), 2.0);
  EXPECT_LT(errors.at("velocity_mps").get<double>(), 0.1);
  EXPECT_EQ(trajectory.size(), run.at("statistics").at("stereo_frames").get<size_t>());
  EXPECT_EQ(trajectory.size(), 60U);  // 1 s to 3.95 s at 20 Hz

  // What the two alignments are is said; both see the same millimetres on such a flight.
  const json& whole = run.at("trajectory_errors");
  EXPECT_EQ(whole.at("alignment").at("position_m"), "SE(3)");
  EXPECT_EQ(whole.at("alignment").at("rotation_deg"), "yaw and position");
  EXPECT_LT(whole.at("position_m").at("rmse").get<double>(), 0.01);
  EXPECT_THAT(readText(run_folder + "/trajectory.tum"), StartsWith("# T_WB: timestamp[s]"));

  const cv::Mat picture = cv::imread(run_folder + "/trajectory.png");
  EXPECT_GE(picture.cols, 300);
  EXPECT_GE(picture.rows, 200);
}

// The same flight in the same room as kFlight, with lenses of 218 degrees; the same bounds.
TEST_P(ChainWith, InitializesWithFisheyes) {
  const std::vector<TumLine> trajectory = replayed(kFisheye, GetParam(), out("folder"));
  const json run = readJson(out("folder") + "/initialization.json");
  EXPECT_THAT(run.at("warnings"), IsEmpty());
  const json attempt = acceptedAttempt(run);
  ASSERT_FALSE(attempt.is_null());
  const json errors = errorsAfterViBa(attempt);
  EXPECT_LT(errors.at("gravity_deg").get<double>(), 2.0);
  EXPECT_LT(errors.at("velocity_mps").get<double>(), 0.1);
  EXPECT_EQ(trajectory.size(), 60U);  // 1 s to 3.95 s at 20 Hz
  EXPECT_LT(run.at("trajectory_errors").at("position_m").at("rmse").get<double>(), 0.01);

  ASSERT_EQ(runEtalon({"convert", kFisheye, out("fisheye.rawlog")}).exit_code, 0);
  const std::vector<TumLine> of_log = replayed(out("fisheye.rawlog"), GetParam(), out("log"));
  EXPECT_EQ(largestDistance(trajectory, of_log), 0.0);
}

TEST_P(ChainWith, FolderAndRawlogsGiveTheSameTrajectoryAndSoDoesASecondRun) {
  ASSERT_EQ(runEtalon({"convert", kFlight, out("external.rawlog")}).exit_code, 0);
  ASSERT_EQ(runEtalon({"convert", kFlight, out("embedded.rawlog"), "--embed"}).exit_code, 0);
  const std::vector<TumLine> trajectory = replayed(kFlight, GetParam(), out("folder"));
  for (const char* log : {"external", "embedded"}) {
    const std::vector<TumLine> other =
        replayed(out(log) + std::string(".rawlog"), GetParam(), out(log));
    EXPECT_EQ(largestDistance(trajectory, other), 0.0) << log;
  }
  replayed(kFlight, GetParam(), out("again"));
  EXPECT_EQ(readText(out("folder") + "/trajectory.tum"),
            readText(out("again") + "/trajectory.tum"));
}

/** Nanoseconds of a TUM file's stamp, by its digits. */
std::string nanoseconds(std::string stamp) { return stamp.erase(stamp.find('.'), 1); }

TEST(Chain, StampsAreTheSensorsToTheNanosecond) {
  const RecordingCopy copy(kFlight);
  for (const char* camera : {"cam0/data.csv", "cam1/data.csv"}) copy.shiftStamps(camera, 37);
  const TemporaryFolder folder;
  const std::string log = folder.path() + "/log.rawlog", run = folder.path() + "/run";
  ASSERT_EQ(runEtalon({"convert", copy.path(), log}).exit_code, 0);
  const std::vector<TumLine> trajectory = replayed(copy.path(), "eta", run);
  std::vector<std::string> stamps = stampsOf(copy.file("cam0/data.csv"));
  stamps.erase(stamps.begin(), stamps.end() - trajectory.size());
  for (size_t i = 0; i < trajectory.size(); ++i)
    EXPECT_EQ(nanoseconds(trajectory[i].stamp), stamps[i]);
  const json record = readJson(run + "/initialization.json");
  for (const json& keyframe : record.at("attempts").at(0).at("keyframes_ns"))
    EXPECT_THAT(stamps, Contains(std::to_string(keyframe.get<long long>())));
  // The log's observations have ticks of 100 ns; its stamps are the same.
  replayed(log, "eta", folder.path() + "/of_log");
  EXPECT_EQ(readText(folder.path() + "/of_log/trajectory.tum"), readText(run + "/trajectory.tum"));
}

TEST_P(ChainWith, ItsConfigurationGivesTheSameRun) {
  // Some value other than the default, so that a file that is ignored would show.
  const CommandResult first =
      runEtalon({"replay", kFlight, "--initializer", GetParam(), "--from", kInMotion, "--set",
                 "pipeline.keyframes=8", "--set", "pipeline.min_keyframes=8", "--set",
                 "frontend.max_features=150", "--out", out("a")});
  ASSERT_EQ(first.exit_code, 0) << first.out << first.err;
  const CommandResult second = runEtalon(
      {"replay", kFlight, "-c", out("a") + "/config.ini", "--from", kInMotion, "--out", out("b")});
  ASSERT_EQ(second.exit_code, 0) << second.out << second.err;
  EXPECT_EQ(readText(out("a") + "/trajectory.tum"), readText(out("b") + "/trajectory.tum"));
  EXPECT_EQ(readText(out("a") + "/config.ini"), readText(out("b") + "/config.ini"));
  const json attempt = acceptedAttempt(readJson(out("b") + "/initialization.json"));
  EXPECT_EQ(attempt.at("keyframes_ns").size(), 8U);
}

TEST_P(ChainWith, AtAStandstillItInitializesOrSaysWhyNot) {
  const CommandResult result =
      runEtalon({"replay", kStandstill, "--initializer", GetParam(), "--out", out("run")});
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 1)) << result.err;
  const json run = readJson(out("run") + "/initialization.json");
  ASSERT_THAT(run.at("attempts"), Not(IsEmpty()));
  EXPECT_EQ(result.exit_code == 0, !acceptedAttempt(run).is_null());
  for (const json& attempt : run.at("attempts")) {
    if (attempt.at("status") != "success") {
      EXPECT_THAT(result.out, HasSubstr("because " + attempt.at("reason").get<std::string>()));
    }
  }
}

TEST(Chain, CompareTabulatesRuns) {
  const TemporaryFolder folder;
  const std::vector<std::string> runs = {folder.path() + "/one", folder.path() + "/two"};
  replayed(kFlight, "eta", runs[0]);
  replayed(kFlight, "orbslam3_inertial_only", runs[1]);
  const auto compare = [&runs](const std::string& format) {
    const CommandResult result =
        runEtalon({"compare", runs[0], runs[1] + "/run.rawlog", "--format", format});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(compare("text"), AllOf(HasSubstr("\none "), HasSubstr("\ntwo "), HasSubstr("eta "),
                                     HasSubstr("RRE [deg]"), HasSubstr("orbslam3_inertial_only "),
                                     HasSubstr("with VI-BA")));
  EXPECT_THAT(compare("markdown"), HasSubstr("| initializer"));

  const std::string csv = compare("csv");  // no field has a comma here
  EXPECT_EQ(countLines(csv), 5U);          // header, and two stages of each run
  const size_t columns = static_cast<size_t>(std::count(csv.begin(), csv.end(), ',')) / 5;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);)
    EXPECT_EQ(static_cast<size_t>(std::count(line.begin(), line.end(), ',')), columns) << line;

  const json record = readJson(runs[0] + "/initialization.json");
  char gravity_deg[40];
  std::snprintf(gravity_deg, sizeof gravity_deg, ",%.9g,",
                errorsAfterViBa(acceptedAttempt(record)).at("gravity_deg").get<double>());
  EXPECT_THAT(csv, AllOf(HasSubstr(",vi_ba,"), HasSubstr(gravity_deg),
                         HasSubstr(",orbslam3_inertial_only,")));
}

TEST(Chain, AutoStartsAtRestAndHandsOverInMotion) {
  const TemporaryFolder folder;
  // Half a second at rest holds a window of 0.4 s.
  const CommandResult result =
      runEtalon({"replay", kFlight, "--set", "pipeline.initializer=auto", "--set",
                 "odometry.kind=stereo_visual", "--set", "pipeline.keyframes=5", "--set",
                 "pipeline.keyframe_rate_hz=10", "--out", folder.path()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.out,
      AllOf(HasSubstr("initialized by static"), HasSubstr("handed over to etalon"),
            ContainsRegex("static initialized at 0\\.[0-9]+ s \\(attempt 1\\); etalon took over "
                          "at [0-9.]+ s \\(attempt [0-9]+\\)"),
            HasSubstr("\nstatic:\n  init "), HasSubstr("\netalon:\n  init ")));
  const json run = readJson(folder.path() + "/initialization.json");
  const json& attempts = run.at("attempts");
  EXPECT_EQ(run.at("initialized_at_ns"), attempts.front().at("stamp_ns"));
  EXPECT_EQ(run.at("handed_over_at_ns"), attempts.back().at("stamp_ns"));
  EXPECT_EQ(run.at("at_rest_initializer"), "static");
  EXPECT_THAT(run.at("at_rest_initializer_path").get<std::string>(), HasSubstr("static"));
  ASSERT_GE(attempts.size(), 2U);
  EXPECT_EQ(attempts.front().at("initializer"), "static");
  EXPECT_EQ(attempts.back().at("initializer"), "etalon");
  EXPECT_EQ(attempts.back().at("status"), "success");
  // A jump at the handover would be an error of the whole trajectory: it is 1 mm on such a flight.
  EXPECT_LT(run.at("trajectory_errors").at("position_m").at("max").get<double>(), 0.01);
}

TEST(Scripts, RefuseArgumentsThatTheyDoNotKnow) {
  for (const char* script : {"/demo.sh", "/build.sh", "/test.sh", "/lint.sh"}) {
    const CommandResult result = runProgram(std::string(ETALON_SCRIPTS) + script, {"--help"});
    EXPECT_EQ(result.exit_code, 2) << script << result.out;
    EXPECT_THAT(result.err, HasSubstr("unknown argument '--help'")) << script;
  }
}

TEST(Chain, RawlogEditReadsTheLogOfARun) {
  if (std::string(ETALON_RAWLOG_EDIT).empty()) GTEST_SKIP() << "rawlog-edit is not installed";
  const TemporaryFolder folder;
  replayed(kFlight, "eta", folder.path() + "/run");
  const CommandResult result =
      runProgram(ETALON_RAWLOG_EDIT, {"--info", "-i", folder.path() + "/run/run.rawlog"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* label : {"eta/init", "eta/vi_ba", "eta/odometry", "ground_truth", "stereo"})
    EXPECT_THAT(result.out, HasSubstr(label));
}

TEST(Chain, AttemptsAfterALossAreNotThoseOfTheFirstStart) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/run";
  // Five seconds without a landmark are more than the IMU alone may carry the pose.
  const CommandResult run = runEtalon({"replay", ETALON_RENDERED "/ten_seconds_aggressive",
                                       "--fault", "covered from=1 for=5.5", "--set",
                                       "odometry.max_dead_reckoning_s=5", "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("etalon initialized after 2 attempts, 0.75 s after the first "
                                 "image; lost at 6.00 s, initialized again at "));
  const CommandResult table = runEtalon({"compare", out, "--format", "csv"});
  EXPECT_GT(readJson(out + "/initialization.json").at("attempts").size(), 2U);
  EXPECT_THAT(table.out, HasSubstr(",etalon,0.75,2,"));
}

}  // namespace
}  // namespace etalon::testing
