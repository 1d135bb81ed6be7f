// `etalon bench` and `etalon merge` on a rendered flight: same files whatever the threads, the
// interruptions and the shards; what is stale or damaged is not trusted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "benchmark_test.h"
#include "chain_files.h"

namespace etalon::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

TEST_F(BenchmarkTest, GivesTheSameFilesWhateverTheThreads) {
  const CommandResult one = runEtalon(arguments("one", {"--jobs", "1"}));
  ASSERT_EQ(one.exit_code, 0) << one.err;
  // 4 keyframes at 4 Hz fit 7 times into 3.95 s and 4 times into 2.55 s; 5 keyframes 7 and 4 times.
  const std::string csv = readText(out("one") + "/windows.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + (7 + 4 + 7 + 4) * 2 * 2);
  EXPECT_THAT(one.out, HasSubstr("RRE"));

  const CommandResult two = runEtalon(arguments("two", {"--jobs", "2"}, out("new")));
  ASSERT_EQ(two.exit_code, 0) << two.err;
  expectSameResults(out("one"), out("two"));
}

TEST_F(BenchmarkTest, ResumesAfterAnInterruption) {
  ASSERT_EQ(runEtalon(arguments("whole")).exit_code, 0);

  std::vector<std::string> interrupted = {"--preserve-status", "-s", "INT", "0.4",
                                          ETALON_EXECUTABLE};
  for (const std::string& argument : arguments("parts", {"--jobs", "1"}))
    interrupted.push_back(argument);
  EXPECT_THAT(runProgram("/usr/bin/timeout", interrupted).exit_code, AnyOf(0, 130));
  // And as if it had been killed in the middle of a line.
  const std::string results = out("parts") + "/windows/flight.jsonl";
  fs::create_directories(out("parts") + "/windows");
  std::string text = fs::exists(results) ? readText(results) : "";
  text = text.substr(0, text.size() / 2);
  std::ofstream(results, std::ios::binary) << text + "{\"sequence\": \"fli";

  const CommandResult resumed = runEtalon(arguments("parts"));
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("were there already"));
  expectSameResults(out("whole"), out("parts"));
}

TEST_F(BenchmarkTest, RefusesAFolderOfAnotherBenchmark) {
  ASSERT_EQ(runEtalon(arguments("x", {"--vi-ba", "off"})).exit_code, 0);
  const CommandResult other = runEtalon(arguments("x"));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("VI-BA"));
  EXPECT_THAT(other.err, HasSubstr("--overwrite"));
  EXPECT_EQ(runEtalon(arguments("x", {"--overwrite"})).exit_code, 0);
}

TEST_F(BenchmarkTest, DamagedTracksAreMadeAnew) {
  ASSERT_EQ(runEtalon(arguments("before", {}, out("tracks"))).exit_code, 0);
  size_t damaged = 0;
  for (const auto& file : fs::directory_iterator(out("tracks"))) {
    std::fstream stream(file.path(), std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(static_cast<std::streamoff>(fs::file_size(file) / 2));
    stream.put('\x5a');
    stream.put('\xa5');
    ++damaged;
  }
  EXPECT_EQ(damaged, 2U);
  const CommandResult after = runEtalon(arguments("after", {}, out("tracks")));
  ASSERT_EQ(after.exit_code, 0) << after.err;
  EXPECT_THAT(after.err, HasSubstr("made anew"));
  EXPECT_THAT(after.err, HasSubstr("damaged"));
  expectSameResults(out("before"), out("after"));
}

TEST_F(BenchmarkTest, ChangedImagesAreTrackedAnew) {
  const RecordingCopy copy(kStandstill);
  const std::vector<std::string> command = {
      "bench",       copy.path(), "--initializers", "eta",    "--every",  "1",
      "--keyframes", "4",         "--out",          out("x"), "--tracks", out("copies")};
  ASSERT_EQ(runEtalon(command).exit_code, 0);
  copy.write(copy.image(0, 20), readText(copy.image(0, 19)));
  const CommandResult again = runEtalon(command);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("has changed since"));
  std::vector<std::string> overwrite = command;
  overwrite.emplace_back("--overwrite");
  ASSERT_EQ(runEtalon(overwrite).exit_code, 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(out("copies")), fs::directory_iterator()), 2);
}

TEST_F(BenchmarkTest, WindowsBeginAtTheSensorsStamps) {
  const RecordingCopy copy(kStandstill);
  for (const char* camera : {"cam0/data.csv", "cam1/data.csv"}) copy.shiftStamps(camera, 37);
  ASSERT_EQ(runEtalon({"bench", copy.path(), "--initializers", "static", "--every", "1",
                       "--keyframes", "4", "--out", out("x")})
                .exit_code,
            0);
  const std::string csv = readText(out("x") + "/windows.csv");
  EXPECT_THAT(csv, HasSubstr(",0," + stampsOf(copy.file("cam0/data.csv")).front() + ",4,4,static"));
}

TEST_F(BenchmarkTest, ARecordingThatCannotBeReadDoesNotSpoilTheOthers) {
  const RecordingCopy broken(kFlight);
  broken.write(broken.file("imu0/data.csv"), "#\n1,2,3\n");
  const CommandResult result =
      runEtalon({"bench", broken.path(), kStandstill, "--initializers", "eta", "--every", "1",
                 "--keyframes", "4", "--out", out("x")});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("was left out"));
  EXPECT_THAT(result.err, HasSubstr("imu0/data.csv:2"));
  EXPECT_THAT(readText(out("x") + "/windows.csv"), HasSubstr("standstill,0"));
}

TEST_F(BenchmarkTest, SaysWhichRecordingIsTooShort) {
  const CommandResult result =
      runEtalon({"bench", kFlight, kStandstill, "--initializers", "eta", "--every", "1",
                 "--keyframes", "13", "--rate", "4", "--tracks", kTracks, "--out", out("x")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string sentence = "standstill: too short for 13 keyframes at 4 Hz (needs 2.88 s, has ";
  EXPECT_THAT(result.err, HasSubstr(sentence));
  EXPECT_THAT(result.out, HasSubstr("Not in the table: " + sentence));
}

TEST_F(BenchmarkTest, RefusesToTryNothing) {
  const CommandResult result = runEtalon(
      {"bench", kStandstill, "--initializers", "eta", "--keyframes", "40", "--out", out("x")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no window is left: standstill: too short for 40 keyframes"));
  EXPECT_FALSE(std::filesystem::exists(out("x")));
}

TEST_F(BenchmarkTest, MergeSaysWhatNoPartCouldRead) {
  const RecordingCopy broken(kFlight);
  broken.write(broken.file("imu0/data.csv"), "#\n1,2,3\n");
  for (const std::string number : {"1", "2"}) {
    const CommandResult part = runEtalon({"bench", broken.path(), kStandstill, "--initializers",
                                          "eta", "--every", "1", "--keyframes", "4", "--tracks",
                                          kTracks, "--out", out(number), "--shard", number + "/2"});
    ASSERT_EQ(part.exit_code, 3) << part.err;
  }
  const CommandResult merged = runEtalon({"merge", out("1"), out("2"), "--out", out("m")});
  EXPECT_EQ(merged.exit_code, 3);
  EXPECT_THAT(merged.err, AllOf(HasSubstr("was left out"), HasSubstr("imu0/data.csv:2"),
                                HasSubstr(" of 2 parts\n")));
  EXPECT_THAT(readText(out("m") + "/windows.csv"), HasSubstr("standstill,0"));
  const CommandResult one = runEtalon({"merge", out("m"), "--out", out("n")});
  EXPECT_EQ(one.exit_code, 3);
  EXPECT_THAT(one.err, HasSubstr(" of 1 part\n"));
}

TEST_F(BenchmarkTest, OptionsMayStandBeforeTheRecordings) {
  const CommandResult result =
      runEtalon({"bench", "--keyframes", "4", "--rate", "4", "--every", "1", "--tracks", kTracks,
                 "--out", out("x"), "--initializers", "eta", kStandstill});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(BenchmarkTest, ACalibratedDeviceIsAConfiguration) {
  // Rendered images have no error that all pixels of a frame share.
  const std::vector<std::string> calibrate = {
      "calibrate-device", kFlight, "--every", "0.25", "--set", "vi_ba.sigma_shared_deg=0.001",
      "--tracks",         kTracks};
  const auto calibrated = [&](const std::string& file, std::vector<std::string> more) {
    std::vector<std::string> arguments = calibrate;
    arguments.insert(arguments.end(), {"--out", out(file)});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runEtalon(arguments);
  };
  const CommandResult result = calibrated("device.ini", {"--name", "quad"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("no biases, because the biases were settled for 0.0 s"));
  // The simulator's IMU has the data sheet's noise: a flight of 4 s tells it to some 25 %.
  EXPECT_THAT(readText(out("device.ini")),
              AllOf(HasSubstr("name = quad\nnoise_from = "),
                    HasSubstr("windows of 1 recording; factors at 0.25 and 0.5 s; gyro 0.")));
  std::ofstream(out("run.ini")) << "[vi_ba]\nrounds = 3\n";
  const CommandResult run = runEtalon(
      {"replay", kFlight, "-c", out("run.ini"), "-c", out("device.ini"), "--out", out("run")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("device quad, 0 flights (" + out("device.ini") + ")"));
  EXPECT_THAT(readText(out("run") + "/config.ini"),
              AllOf(HasSubstr("name = quad\n"), HasSubstr("rounds = 3\n")));
  // A prior that pins the accelerometer's bias is widened.
  const CommandResult pinned =
      calibrated("pinned.ini", {"--name", "quad", "--set", "priors.accel_bias_sigma_mps2=0.003"});
  ASSERT_EQ(pinned.exit_code, 0) << pinned.err;
  EXPECT_EQ(readText(out("pinned.ini")), readText(out("device.ini")));
}

TEST_F(BenchmarkTest, ADeviceFileIsNotMadeOfNothing) {
  EXPECT_EQ(runEtalon({"calibrate-device", kFlight, "--set", "pipeline.keyframes=100", "--out",
                       out("none.ini")})
                .exit_code,
            3);
  EXPECT_FALSE(fs::exists(out("none.ini")));
  const CommandResult nothing = runEtalon({"calibrate-device", "--out", out("none.ini")});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("expected recordings, or a device file (--base)"));
}

TEST_F(BenchmarkTest, FlightsOfADeviceFileCanBeLeftOut) {
  std::ofstream(out("two.ini"))
      << "[device]\nname = d\n[flights]\n"
         "a = 1 2 | 0 0 0.01 1e-4 1e-4 1e-4 0 | 0 0 0.1 0.01 0.01 0.01 0\n"
         "b = 1 2 | 0 0 0.02 1e-4 1e-4 1e-4 0 | 0 0 0.1 0.01 0.01 0.01 0\n";
  const auto without = [this](const std::string& flight) {
    return runEtalon({"calibrate-device", "--base", out("two.ini"), "--without", flight, "--out",
                      out("one.ini")});
  };
  ASSERT_EQ(without("b").exit_code, 0);
  EXPECT_THAT(readText(out("one.ini")),
              AllOf(HasSubstr("flights = 1\n"), HasSubstr("gyro_bias_mean_z_rps = 0.01\n")));
  EXPECT_EQ(without("c").exit_code, 2);
}

TEST_F(BenchmarkTest, TheDeviceFileOfEurocIsUpToDateAndAConfiguration) {
  const std::string device = ETALON_SCRIPTS "/../config/devices/euroc.ini";
  ASSERT_EQ(runEtalon({"calibrate-device", "--base", device, "--out", out("same.ini")}).exit_code,
            0);
  EXPECT_EQ(readText(out("same.ini")), readText(device));
  const CommandResult run =
      runEtalon({"replay", kFlight, "-c", device, "--to", "0.2", "--out", out("run")});
  EXPECT_EQ(run.exit_code, 1) << run.err;  // too brief to initialize
  EXPECT_THAT(run.out, HasSubstr("device EuRoC MAV, VI-Sensor, 7 flights (" + device + ")"));
}

TEST_F(BenchmarkTest, AFlightThatIsTooBriefLeavesTheDeviceFileAsItIs) {
  const std::string file = out("device.ini");
  const auto replayed = [&] {
    return runEtalon({"replay", kFlight, "--update-device", file, "--out", out("run")});
  };
  const CommandResult run = replayed();
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, AllOf(HasSubstr("stays as it is"), HasSubstr("at least 10 s are wanted")));
  EXPECT_FALSE(fs::exists(file));
  std::ofstream(file) << "[pipeline]\n";
  const CommandResult other = replayed();
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("is no device file"));
}

TEST_F(BenchmarkTest, SaysWhatIsWrongWithTheArguments) {
  const auto error = [this](const std::vector<std::string>& more) {
    const CommandResult result = runEtalon(arguments("x", more));
    EXPECT_EQ(result.exit_code, 2);
    return result.err;
  };
  EXPECT_THAT(error({"--rate", "50"}), HasSubstr("'flight' has 20.0 images a second"));
  EXPECT_THAT(error({"--shard", "3/2"}), HasSubstr("1 <= K <= N"));
  EXPECT_THAT(error({kFlight}), HasSubstr("two recordings are called 'flight'"));
  EXPECT_THAT(error({"--set", "vi_ba.round=3"}), HasSubstr("did you mean 'rounds'"));
}

TEST_F(BenchmarkTest, PythonReadsEveryResultAsThePageSays) {
  const std::string python = "/usr/bin/python3";
  if (!fs::exists(python)) GTEST_SKIP() << python << " is missing";
  const std::string page = readText(ETALON_SCRIPTS "/../docs/reading-results.md");
  const size_t begin = page.find("```python\n") + 10;
  std::ofstream(out("read.py")) << page.substr(begin, page.find("\n```", begin) - begin) << "\n";
  ASSERT_EQ(runEtalon(arguments("bench")).exit_code, 0);
  ASSERT_EQ(runEtalon({"replay", kFlight, "--from", kInMotion, "--out", out("run")}).exit_code, 0);

  const CommandResult read = runProgram(python, {out("read.py"), out("run"), out("bench")});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  for (const char* file : {"trajectory.tum", "trajectory_smoothed.tum", "states.csv",
                           "attempt success", "windows.csv", "summary.csv eta success"})
    EXPECT_THAT(read.out, HasSubstr(file));
}

}  // namespace
}  // namespace etalon::testing
