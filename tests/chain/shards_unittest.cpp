// Shards of a benchmark through GNU parallel and Slurm, and what `etalon merge` refuses.
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
using ::testing::HasSubstr;
using ::testing::Not;

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
    EXPECT_FALSE(fs::exists(out("m") + "/windows.csv"));
    return result.err;
  };
  EXPECT_THAT(error({one}), AllOf(HasSubstr("missing"), HasSubstr("of 3 shards not given: 2,3")));
  EXPECT_THAT(error({one, two, one}), HasSubstr("twice"));
  EXPECT_THAT(error({one, out("a"), out("b")}),
              HasSubstr("'" + out("a") + "', '" + out("b") + "'"));
  // As if shard 3 had been killed while it began anew.
  fs::remove_all(three + "/windows");
  fs::remove(three + "/windows.csv");
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
  EXPECT_TRUE(fs::exists(out("parts") + "/merged/windows.csv"));
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

}  // namespace
}  // namespace etalon::testing
