// `etalon trial` on a rendered flight: what comes before a fault is flown once and changes nothing; the same files whatever
// the processes and the shards; other systems beside ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "chain_files.h"

namespace etalon::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** Two seconds from 1 s on (in motion) and from 1.8 s on; a fault begins after the start. */
class TrialTest : public ::testing::Test {
 protected:
  /** The trial that the others are held against, in one process. */
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    folder_->write("faults.ini",
                   "[faults]\ndark = covered from=1.5 for=0.2\nevery_2nd = every n=2\n");
    one_ = trial("one", {"--jobs", "1"});
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string out(const std::string& name) { return folder_->path() + "/" + name; }
  static CommandResult trial(const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {
        "trial",           kFlight,     "--out", out(name),        "--faults",
        out("faults.ini"), "--seconds", "2",     "--initializers", "eta"};
    const bool starts_given = std::find(more.begin(), more.end(), "--from") != more.end();
    if (!starts_given) all.insert(all.end(), {"--from", "1,1.8"});
    all.insert(all.end(), more.begin(), more.end());
    return runEtalon(all);
  }
  /** A line of runs.csv without its time, by start and fault. */
  static std::string rowOf(const std::string& name, const std::string& beginning) {
    std::istringstream csv(readText(out(name) + "/runs.csv"));
    for (std::string line; std::getline(csv, line);)
      if (line.compare(0, beginning.size(), beginning) == 0) return line.substr(0, line.rfind(','));
    return "no row " + beginning;
  }
  /** All files of a trial's folder that are compared, one after the other. */
  static std::string resultsOf(const std::string& name) {
    std::string all;
    std::istringstream csv(readText(out(name) + "/runs.csv"));
    for (std::string line; std::getline(csv, line);) all += line.substr(0, line.rfind(',')) + "\n";
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(out(name) + "/trajectories"))
      if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) all += file.filename().string() + readText(file.string());
    return all;
  }

  static TemporaryFolder* folder_;
  static CommandResult one_;
};
TemporaryFolder* TrialTest::folder_ = nullptr;
CommandResult TrialTest::one_;

TEST_F(TrialTest, GivesTheSameFilesWhateverTheProcessesAndShards) {
  ASSERT_EQ(one_.exit_code, 0) << one_.err;
  EXPECT_THAT(one_.out, AllOf(HasSubstr("1 recording, 2 starts of 2 s, 2 faults"),
                              HasSubstr("every_2nd"), HasSubstr("6/6")));
  EXPECT_TRUE(fs::exists(out("one") + "/report.html"));
  ASSERT_EQ(trial("two", {"--jobs", "2"}).exit_code, 0);
  EXPECT_EQ(resultsOf("one"), resultsOf("two"));
  ASSERT_EQ(trial("s1", {"--shard", "1/2"}).exit_code, 0);
  ASSERT_EQ(trial("s2", {"--shard", "2/2"}).exit_code, 0);
  ASSERT_EQ(runEtalon({"merge", out("s1"), out("s2"), "--out", out("m")}).exit_code, 0);
  EXPECT_EQ(resultsOf("one"), resultsOf("m"));
}

TEST_F(TrialTest, ARunWithAFaultIsThatOfReplay) {
  EXPECT_THAT(rowOf("one", "flight,1,,,fixed_lag,eta,dark"),
              AllOf(HasSubstr("survived"), HasSubstr("the images show no landmark")));
  // The same fault made by replay, from the beginning.
  const CommandResult replayed = runEtalon(
      {"replay", kFlight, "--from", "1", "--to", "3", "--fault", "covered from=1.5 for=0.2",
       "--initializer", "eta", "--set", "pipeline.min_keyframes=3", "--out", out("replay")});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  const std::vector<TumLine> whole = readTum(out("replay") + "/trajectory.tum"),
                             flown = readTum(out("one") +
                                             "/trajectories/fixed_lag-eta/flight-1-dark.tum");
  EXPECT_EQ(largestDistance(whole, flown), 0.0);
}

TEST_F(TrialTest, OtherSystemsStandBesideOurs) {
  // A system that has our trajectory of one run alone.
  fs::create_directories(out("theirs"));
  fs::copy_file(out("one") + "/trajectories/fixed_lag-eta/flight-1-every_2nd.tum",
                out("theirs") + "/flight-1-every_2nd.tum");
  const CommandResult both = trial("both", {"--from", "1", "--system", "theirs=" + out("theirs")});
  ASSERT_EQ(both.exit_code, 0) << both.err;
  EXPECT_THAT(both.out, AllOf(HasSubstr("theirs"), HasSubstr("1/3"),
                              HasSubstr("there is no trajectory 'flight-1-none.tum'")));
  const std::string ours = rowOf("both", "flight,1,,,fixed_lag,eta,every_2nd"),
                    theirs = rowOf("both", "flight,1,theirs,,,,every_2nd");
  EXPECT_THAT(theirs, HasSubstr(",survived,0,,"));
  EXPECT_THAT(ours, HasSubstr(",21,21,1,"));  // frames, poses, coverage
  EXPECT_THAT(theirs, HasSubstr(",21,21,1,"));

  const CommandResult compared =
      runEtalon({"compare", out("theirs"), out("one") + "/trajectories/fixed_lag-eta",
                 "--recording", kFlight});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, AllOf(HasSubstr("theirs"), HasSubstr("fixed_lag-eta")));

  // Folders of runs, and any file: names that tell them apart, and one picture of all.
  for (const char* run : {"run_a", "run_b"}) {
    fs::create_directories(out(run));
    fs::copy_file(out("theirs") + "/flight-1-every_2nd.tum", out(run) + "/trajectory.tum");
  }
  fs::copy_file(out("run_a") + "/trajectory.tum", out("foreign.txt"));
  const CommandResult drawn =
      runEtalon({"compare", out("run_a"), out("run_b") + "/trajectory.tum", out("foreign.txt"),
                 "--recording", kFlight, "--save-plot", out("all.png")});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(drawn.out,
              AllOf(HasSubstr("\nrun_a "), HasSubstr("\ntrajectory "), HasSubstr("\nforeign ")));
  EXPECT_TRUE(fs::exists(out("all.png")));
  const CommandResult alike = runEtalon({"compare", out("run_a") + "/trajectory.tum",
                                         out("run_b") + "/trajectory.tum", "--recording", kFlight});
  EXPECT_THAT(alike.out, AllOf(HasSubstr("\nrun_a/trajectory "), HasSubstr("\nrun_b/trajectory ")));
  EXPECT_EQ(runEtalon({"compare", out("run_a"), out("run_a"), "--recording", kFlight}).exit_code,
            2);
}

TEST_F(TrialTest, RefusesWhatCannotBe) {
  EXPECT_EQ(trial("x", {"--settings", "nonsense"}).exit_code, 2);
  EXPECT_EQ(trial("x", {"--shard", "3/2"}).exit_code, 2);
  EXPECT_THAT(
      trial("x", {"--settings", "b:map.enabeld=false"}).err,
      AllOf(HasSubstr("--settings b: [map] enabeld"), HasSubstr("did you mean 'enabled'?")));
  EXPECT_THAT(trial("x", {"--settings", "b:map"}).err,
              HasSubstr("--settings b: 'map': expected section.key=value"));
  EXPECT_EQ(trial("x", {"--odometries", "nonsense"}).exit_code, 2);
  EXPECT_THAT(trial("x", {"--system", "theirs=" + out("nothing")}).err, HasSubstr("no folder"));
  const CommandResult other = trial("one", {"--seed", "2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("another seed"));
}

}  // namespace
}  // namespace etalon::testing
