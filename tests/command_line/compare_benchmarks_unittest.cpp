#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "etalon/benchmark/store.h"
#include "etalon/testing/example_benchmark.h"
#include "run_command.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/** The folder of a benchmark as `etalon bench` leaves it. */
std::string writeExample(const TemporaryFolder& folder,
                         const BenchmarkRecord& record = exampleBenchmark()) {
  writeBenchmarkHead(folder.path(), record);
  ResultStore store(folder.path());
  for (const WindowResult& result : record.results) store.append(result);
  return folder.path();
}

TEST(CompareBenchmarks, PrintsTablesAndWhatIsSignificant) {
  const TemporaryFolder folder;
  const CommandResult result = runEtalon({"compare", writeExample(folder), "--verbose"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("Success [%], 10 keyframes at 4 Hz"), HasSubstr("RRE [deg], median"),
                    HasSubstr("Paired comparison"), HasSubstr("too few pairs"),
                    HasSubstr("10000 resamples, seed 1"), HasSubstr("Best marked *"),
                    HasSubstr("Good estimates, accepted or not"), HasSubstr("Check of the noise"),
                    HasSubstr("gravity, corrected [deg], median"), HasSubstr("gyro bias"),
                    HasSubstr("A = good, B = bad"), Not(HasSubstr("\033"))));
  EXPECT_THAT(runEtalon({"compare", folder.path(), "--bold"}).out, HasSubstr("\033[1m"));
}

TEST(CompareBenchmarks, PrintsOneScreenUnlessToldOtherwise) {
  const TemporaryFolder folder;
  const CommandResult result = runEtalon({"compare", writeExample(folder)});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("2 recordings, 10 keyframes at 4 Hz"),
                                HasSubstr("Compared with good"), HasSubstr("too few pairs")));
  EXPECT_LE(std::count(result.out.begin(), result.out.end(), '\n'), 25);
}

TEST(CompareBenchmarks, CutsTablesThatAreWiderThanTheTerminal) {
  const TemporaryFolder folder;
  const std::string path = writeExample(folder);
  const std::string below = "\n          with VI-BA";  // with the sequences to its left again
  ASSERT_EQ(setenv("COLUMNS", "30", 1), 0);
  const CommandResult narrow = runEtalon({"compare", path, "--metric", "rre_deg"});
  ASSERT_EQ(unsetenv("COLUMNS"), 0);
  EXPECT_THAT(narrow.out, HasSubstr(below));
  EXPECT_THAT(runEtalon({"compare", path, "--metric", "rre_deg"}).out, Not(HasSubstr(below)));
}

TEST(CompareBenchmarks, IsBoldInATerminalUnlessToldOtherwise) {
  const std::string script = "/usr/bin/script";
  if (!std::filesystem::exists(script)) GTEST_SKIP() << script << " (util-linux) is missing";
  const TemporaryFolder folder;
  const std::string command = ETALON_EXECUTABLE " compare '" + writeExample(folder) + "'";
  const auto inTerminal = [&](const std::string& environment) {
    return runProgram(script, {"-qec", "env " + environment + " " + command, "/dev/null"}).out;
  };
  EXPECT_THAT(inTerminal("-u NO_COLOR TERM=xterm"),
              AllOf(HasSubstr("\033[1m"), HasSubstr("Best in bold"), Not(HasSubstr("marked *"))));
  for (const char* plain : {"NO_COLOR=1 TERM=xterm", "-u NO_COLOR TERM=dumb"})
    EXPECT_THAT(inTerminal(plain), AllOf(Not(HasSubstr("\033[1m")), HasSubstr("Best marked *")))
        << plain;
}

TEST(MergeBenchmarks, SaysAtTheEndWhatWasLeftOut) {
  const TemporaryFolder folder, out;
  BenchmarkRecord record = exampleBenchmark();
  record.sequences[0].unreadable_images = 3;
  record.sequences[0].stereo_frames = 140;
  BenchmarkSequence shorter;
  shorter.name = "V2";
  shorter.last_image = 2'000'000'000;
  record.sequences.push_back(shorter);
  const CommandResult result =
      runEtalon({"merge", writeExample(folder, record), "--out", out.path() + "/all"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("V1: 3 of 140 stereo pairs could not be read"));
  EXPECT_THAT(result.err, HasSubstr("V2: too short for 10 keyframes at 4 Hz (needs 2.12 s, has "
                                    "2.00 s): 0 windows"));
}

TEST(MergeBenchmarks, OfAPartThatCannotBeReadJoinsNothing) {
  const TemporaryFolder folder, out;
  const std::string path = writeExample(folder);
  std::ofstream(path + "/benchmark.json") << "{\"run\": ";
  const CommandResult result = runEtalon({"merge", path, "--out", out.path() + "/all"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, HasSubstr("benchmark.json"));
  EXPECT_FALSE(std::filesystem::exists(out.path() + "/all"));
}

TEST(MergeBenchmarks, PrintsOneCsvTable) {
  const TemporaryFolder folder, out;
  const std::string path = writeExample(folder);
  const CommandResult csv =
      runEtalon({"merge", path, "--out", out.path() + "/csv", "--format", "csv"});
  EXPECT_EQ(csv.exit_code, 0) << csv.err;
  EXPECT_THAT(csv.err, HasSubstr("of 1 part\n"));
  EXPECT_EQ(csv.out.rfind("metric,statistic,keyframes,", 0), 0u);
  EXPECT_EQ(csv.out.find("metric,statistic", 1), std::string::npos);
}

TEST(CompareBenchmarks, ChoosesInitializersMetricsAndSeed) {
  const TemporaryFolder folder;
  const std::string path = writeExample(folder);
  const CommandResult result = runEtalon({"compare", path, "--initializers", "bad,good", "--metric",
                                          "success,gravity_deg", "--seed", "7", "--format", "csv"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1 + 4);  // 2 figures, 2 stages
  EXPECT_THAT(result.out, HasSubstr("\nbad,good,10,4,init,success,5,5,5,1,"));
  EXPECT_THAT(result.out, HasSubstr("\nbad,good,10,4,init,gravity_deg,4,5,4,1,"));
  const CommandResult text = runEtalon({"compare", path, "--metric", "gravity_deg", "--seed", "7"});
  EXPECT_THAT(text.out, AllOf(HasSubstr("gravity [deg], 90th percentile"), HasSubstr("seed 7"),
                              Not(HasSubstr("RRE")), Not(HasSubstr("corrected"))));
}

TEST(CompareBenchmarks, PutsFoldersBesideEachOther) {
  const TemporaryFolder one, two;
  const CommandResult result = runEtalon(
      {"compare", writeExample(one), writeExample(two), "--metric", "rre_deg", "--format", "csv"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("/good"));
  EXPECT_THAT(result.out, HasSubstr("/bad"));
}

TEST(CompareBenchmarks, SaysAtTheTopWhatIsMissing) {
  const TemporaryFolder folder, complete;
  BenchmarkRecord record = exampleBenchmark();
  // 8 windows, of which the example has not all, for 2 initializers.
  record.sequences[0].last_image = record.sequences[0].first_image + 20'000'000'000;
  BenchmarkSequence broken;
  broken.name = "V9";
  broken.error = "no IMU";
  record.sequences.push_back(broken);
  record.shard = 2;
  record.shards = 8;
  const CommandResult result = runEtalon({"compare", writeExample(folder, record)});
  EXPECT_EQ(result.exit_code, 1);
  const std::string count = std::to_string(missingResults(record).size()) + " of 16 results";
  EXPECT_EQ(result.out.rfind("INCOMPLETE: ", 0), 0u);
  EXPECT_THAT(result.out, AllOf(HasSubstr("unfinished: " + count + " are missing"),
                                HasSubstr("shard 2 of 8"), HasSubstr("V1: " + count + " missing\n"),
                                HasSubstr("V9: not in it: no IMU"), HasSubstr("success [%]")));
  const CommandResult csv = runEtalon({"compare", folder.path(), "--format", "csv"});
  EXPECT_EQ(csv.exit_code, 1);
  EXPECT_THAT(csv.err, HasSubstr(count + " are missing"));
  EXPECT_THAT(csv.out, Not(HasSubstr("INCOMPLETE")));
  EXPECT_THAT(runEtalon({"compare", writeExample(complete)}).out, Not(HasSubstr("INCOMPLETE")));
}

TEST(CompareBenchmarks, RefusesWhatCannotBeCompared) {
  const TemporaryFolder folder, run;
  const std::string path = writeExample(folder);
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"compare", path, run.path()}, "folders of one kind"},
      {{"compare", path, "--initializers", "good,best"}, "expected one of good, bad"},
      {{"compare", path, "--initializers", "good", "--format", "csv"}, "summary.csv"}};
  for (const auto& [arguments, expected] : wrong) {
    const CommandResult result = runEtalon(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.back();
    EXPECT_THAT(result.err, HasSubstr(expected));
    EXPECT_THAT(result.out, IsEmpty());
  }
}

TEST(CompareBenchmarks, DrawNothing) {
  const TemporaryFolder folder;
  const std::string picture = folder.path() + "/x.png";
  const CommandResult result = runEtalon({"compare", writeExample(folder), "--save-plot", picture});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--save-plot: expected folders of runs"));
}

}  // namespace
}  // namespace etalon::testing
