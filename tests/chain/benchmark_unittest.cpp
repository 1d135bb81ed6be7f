// `etalon bench` and `etalon merge` on a rendered flight: same files whatever the threads, the
// interruptions and the shards; what is stale or damaged is not trusted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "chain_files.h"

namespace etalon::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

/** The tracks of all tests that do not spoil them. */
const std::string kTracks = ETALON_RENDERED "/tracks";

/** Runs benchmarks of the two rendered recordings in a folder of its own. */
class BenchmarkTest : public ::testing::Test {
 protected:
  std::string out(const std::string& name) const { return folder_.path() + "/" + name; }

  /** Short windows, so that the short flights have several. */
  std::vector<std::string> arguments(const std::string& name,
                                     const std::vector<std::string>& more = {},
                                     const std::string& tracks = kTracks) const {
    std::vector<std::string> all = {"bench", kFlight, kStandstill, "--out", out(name)};
    for (const std::vector<std::string>& option :
         {std::vector<std::string>{"--initializers", "eta,orbslam3_inertial_only"},
          {"--every", "0.5"},
          {"--keyframes", "4,5"},
          {"--rate", "4"},
          {"--tracks", tracks}})
      all.insert(all.end(), option.begin(), option.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  TemporaryFolder folder_;
};

/** Runs the Slurm script as a task of an array would be, with the variables that sbatch sets. */
CommandResult runSlurmTask(int task, int first, int last, const std::vector<std::string>& arguments,
                           const std::string& path = fs::path(ETALON_EXECUTABLE).parent_path()) {
  std::vector<std::string> words = {"-u",
                                    "SLURM_CPUS_PER_TASK",
                                    "PATH=" + path + ":/usr/bin:/bin",
                                    "SLURM_ARRAY_TASK_ID=" + std::to_string(task),
                                    "SLURM_ARRAY_TASK_MIN=" + std::to_string(first),
                                    "SLURM_ARRAY_TASK_MAX=" + std::to_string(last),
                                    "SLURM_ARRAY_TASK_COUNT=" + std::to_string(last - first + 1),
                                    ETALON_SCRIPTS "/cluster/slurm_array.sh"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return runProgram("/usr/bin/env", words);
}

/** A CSV file without its columns of run times, which are the last ones of every line. */
std::string withoutTimes(const std::string& path) {
  std::istringstream text(readText(path));
  std::string header, result;
  std::getline(text, header);
  const size_t times = header.find(",runtime_ms");
  if (times == std::string::npos) throw std::runtime_error(path + ": no column runtime_ms");
  size_t columns = 0;
  for (const char c : header.substr(times)) columns += c == ',' ? 1 : 0;
  result = header.substr(0, times) + "\n";
  for (std::string line; std::getline(text, line);) {
    for (size_t i = 0; i < columns; ++i) line.erase(line.rfind(','));
    result += line + "\n";
  }
  return result;
}

void expectSameResults(const std::string& a, const std::string& b) {
  for (const char* file : {"/segments.csv", "/summary.csv"})
    EXPECT_EQ(withoutTimes(a + file), withoutTimes(b + file)) << a << " and " << b << file;
}

TEST_F(BenchmarkTest, GivesTheSameFilesWhateverTheThreads) {
  const CommandResult one = runEtalon(arguments("one", {"--jobs", "1"}));
  ASSERT_EQ(one.exit_code, 0) << one.err;
  // 4 keyframes at 4 Hz fit 7 times into 3.95 s and 4 times into 2.55 s; 5 keyframes 7 and 4 times.
  const std::string csv = readText(out("one") + "/segments.csv");
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
  const std::string results = out("parts") + "/slots/flight.jsonl";
  fs::create_directories(out("parts") + "/slots");
  std::string text = fs::exists(results) ? readText(results) : "";
  text = text.substr(0, text.size() / 2);
  std::ofstream(results, std::ios::binary) << text + "{\"sequence\": \"fli";

  const CommandResult resumed = runEtalon(arguments("parts"));
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("were there already"));
  expectSameResults(out("whole"), out("parts"));
}

TEST_F(BenchmarkTest, ShardsThroughGnuParallelGiveTheSameFiles) {
  if (std::string(ETALON_GNU_PARALLEL).empty()) GTEST_SKIP() << "GNU parallel is not installed";
  ASSERT_EQ(runEtalon(arguments("whole")).exit_code, 0);
  std::vector<std::string> script = {"--etalon",
                                     ETALON_EXECUTABLE,
                                     "3",
                                     out("cluster"),
                                     "--jobs",
                                     "2",
                                     "--",
                                     kFlight,
                                     kStandstill,
                                     "--initializers",
                                     "eta,orbslam3_inertial_only",
                                     "--every",
                                     "0.5",
                                     "--keyframes",
                                     "4,5",
                                     "--rate",
                                     "4"};
  const CommandResult spread = runProgram(ETALON_SCRIPTS "/cluster/gnu_parallel.sh", script);
  ASSERT_EQ(spread.exit_code, 0) << spread.out << spread.err;
  expectSameResults(out("whole"), out("cluster") + "/merged");

  const std::string one = out("cluster") + "/shard-1", two = out("cluster") + "/shard-2",
                    three = out("cluster") + "/shard-3";
  const auto error = [this](const std::vector<std::string>& folders) {
    std::vector<std::string> command = {"merge", "--out", out("m")};
    command.insert(command.end(), folders.begin(), folders.end());
    const CommandResult result = runEtalon(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_FALSE(fs::exists(out("m") + "/segments.csv"));
    return result.err;
  };
  EXPECT_THAT(error({one}), AllOf(HasSubstr("missing"), HasSubstr("of 3 shards not given: 2,3")));
  EXPECT_THAT(error({one, two, one}), HasSubstr("twice"));
  EXPECT_THAT(error({one, out("a"), out("b")}),
              HasSubstr("'" + out("a") + "', '" + out("b") + "'"));
  // As if shard 3 had been killed while it began anew.
  fs::remove_all(three + "/slots");
  fs::remove(three + "/segments.csv");
  EXPECT_THAT(error({one, two, three}),
              AllOf(HasSubstr("interrupted"), HasSubstr("shard 3/3 ('" + three + "')"),
                    Not(HasSubstr("not given"))));
}

TEST_F(BenchmarkTest, GnuParallelSaysWhichShardFailed) {
  if (std::string(ETALON_GNU_PARALLEL).empty()) GTEST_SKIP() << "GNU parallel is not installed";
  // A host whose etalon is no etalon: the copy in its folder cannot run the second shard.
  const std::string program =
      folder_.write("etalon",
                    "#!/bin/sh\ncase \"$*\" in *' --shard 2/2 '*) exit 7 ;; esac\n"
                    "exec '" ETALON_EXECUTABLE "' \"$@\"\n");
  fs::permissions(program, fs::perms::owner_all);
  const auto run = [&](const std::string& etalon) {
    return runProgram(ETALON_SCRIPTS "/cluster/gnu_parallel.sh",
                      {"--etalon", etalon, "2", out("parts"), "--jobs", "1", "--", kStandstill,
                       "--initializers", "eta", "--every", "0.5", "--keyframes", "4"});
  };
  const CommandResult failed = run(program);
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.err,
              AllOf(HasSubstr("shard 2 on this machine ended with 7"),
                    HasSubstr("no benchmark (benchmark.json) in '" + out("parts") + "/shard-2'")));
  const CommandResult again = run(ETALON_EXECUTABLE);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(fs::exists(out("parts") + "/merged/segments.csv"));
  EXPECT_THAT(run(out("nothing")).err, HasSubstr("there is no program"));
}

TEST_F(BenchmarkTest, ShardsAsTasksOfSlurmGiveTheSameFiles) {
  ASSERT_EQ(runEtalon(arguments("whole")).exit_code, 0);
  std::vector<std::string> task = arguments("cluster");
  task.erase(task.begin());
  task.erase(std::find(task.begin(), task.end(), "--out"),
             std::find(task.begin(), task.end(), "--initializers"));
  task.erase(std::find(task.begin(), task.end(), "--tracks"), task.end());
  task.insert(task.begin(), out("cluster"));

  const CommandResult alone = runSlurmTask(2, 2, 2, task);
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, HasSubstr("must count from 1"));
  const CommandResult without = runSlurmTask(1, 1, 3, task, "/nowhere");
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, HasSubstr("etalon is not in the PATH"));

  for (const int number : {1, 3}) {
    const CommandResult part = runSlurmTask(number, 1, 3, task);
    ASSERT_EQ(part.exit_code, 0) << part.err;
  }
  // The one that is missing, in an array of its own.
  const CommandResult second = runSlurmTask(2, 2, 2, task);
  ASSERT_EQ(second.exit_code, 0) << second.err;
  const CommandResult fourth = runSlurmTask(4, 1, 4, task);
  EXPECT_EQ(fourth.exit_code, 2);
  EXPECT_THAT(fourth.err, HasSubstr("begun with 3"));

  const CommandResult merged =
      runEtalon({"merge", out("cluster") + "/shard-1", out("cluster") + "/shard-2",
                 out("cluster") + "/shard-3", "--out", out("cluster") + "/merged"});
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  expectSameResults(out("whole"), out("cluster") + "/merged");
}

TEST_F(BenchmarkTest, ARecordingThatOneShardCannotReadIsRefused) {
  const RecordingCopy copy(kFlight);
  const auto shard = [&](const std::string& number, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"bench",       copy.path(), kStandstill,  "--initializers",
                                        "eta",         "--every",   "0.5",        "--keyframes",
                                        "4",           "--out",     out(number),  "--tracks",
                                        out("tracks"), "--shard",   number + "/2"};
    command.insert(command.end(), more.begin(), more.end());
    return runEtalon(command);
  };
  const std::string imu = readText(copy.file("imu0/data.csv"));
  ASSERT_EQ(shard("1").exit_code, 0);
  copy.write(copy.file("imu0/data.csv"), "");
  ASSERT_EQ(shard("2").exit_code, 3);
  const CommandResult merged = runEtalon({"merge", out("1"), out("2"), "--out", out("m")});
  EXPECT_EQ(merged.exit_code, 2);
  EXPECT_THAT(merged.err, HasSubstr("could not read the recording"));

  copy.write(copy.file("imu0/data.csv"), imu);
  EXPECT_THAT(shard("2").err, HasSubstr("--overwrite"));
  ASSERT_EQ(shard("2", {"--overwrite"}).exit_code, 0);
  EXPECT_EQ(runEtalon({"merge", out("1"), out("2"), "--out", out("m")}).exit_code, 0);
}

TEST_F(BenchmarkTest, ShardsOfAnotherConfigurationAreRefused) {
  const auto shard = [this](const std::string& number, const std::string& sigma) {
    return runEtalon(arguments("shard" + number,
                               {"--shard", number + "/2", "--set", "odometry.sigma_px=" + sigma}));
  };
  ASSERT_EQ(shard("1", "0.5").exit_code, 0);
  ASSERT_EQ(shard("2", "0.6").exit_code, 0);
  const CommandResult merged =
      runEtalon({"merge", out("shard1"), out("shard2"), "--out", out("m")});
  EXPECT_EQ(merged.exit_code, 2);
  EXPECT_THAT(merged.err, HasSubstr("sigma_px = 0.6"));
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
  const std::string csv = readText(out("x") + "/segments.csv");
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
  EXPECT_THAT(readText(out("x") + "/segments.csv"), HasSubstr("standstill,0"));
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
  EXPECT_THAT(readText(out("m") + "/segments.csv"), HasSubstr("standstill,0"));
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

TEST_F(BenchmarkTest, CalibratedNoiseIsAConfiguration) {
  const CommandResult result =
      runEtalon({"calibrate-noise", kFlight, "--every", "0.25", "--set", "pipeline.keyframes=5",
                 "--tracks", kTracks, "--out", out("noise.ini")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  // The simulator's IMU has the data sheet's noise: a flight of 4 s tells it to some ten percent.
  EXPECT_THAT(readText(out("noise.ini")),
              AllOf(HasSubstr("[imu_noise]\ngyro_noise_factor = "), HasSubstr("; sigma_px = ")));
  const CommandResult run =
      runEtalon({"replay", kFlight, "-c", out("noise.ini"), "--out", out("run")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // A prior that pins the accelerometer's bias is widened.
  const CommandResult pinned = runEtalon(
      {"calibrate-noise", kFlight, "--every", "0.25", "--set", "pipeline.keyframes=5", "--set",
       "priors.accel_bias_sigma_mps2=0.003", "--tracks", kTracks, "--out", out("pinned.ini")});
  ASSERT_EQ(pinned.exit_code, 0) << pinned.err;
  EXPECT_EQ(readText(out("pinned.ini")), readText(out("noise.ini")));
  EXPECT_EQ(runEtalon({"calibrate-noise", kFlight, "--set", "pipeline.keyframes=100"}).exit_code,
            3);
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

}  // namespace
}  // namespace etalon::testing
