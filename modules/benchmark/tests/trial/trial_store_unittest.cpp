#include "etalon/benchmark/trial/trial_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "etalon/benchmark/trial/trial.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/testing/example_trial.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::exampleTrial;
using ::testing::HasSubstr;

class TrialStoreTest : public ::testing::Test {
 protected:
  std::string out(const std::string& name) const { return (folder_ / name).string(); }

  /** Writes the folder of a trial, the runs in reverse. */
  static void write(const std::string& folder, const TrialRecord& record, bool complete = true) {
    writeTrialHead(folder, record);
    LineStore store(folder + "/runs");
    for (auto run = record.results.rbegin(); run != record.results.rend(); ++run) {
      store.append(run->recording, resultToText(*run));
      const fs::path trajectory = trajectoryPath(folder, record, *run);
      makeFolder(trajectory.parent_path().string());
      writeTum(trajectory.string(), {{durationNs(run->from_s), SE3()}});
    }
    if (complete) writeTrialResults(folder, record, nullptr);
  }

  /** Part 1 has the runs of "a", part 2 those of "b". */
  static TrialRecord shard(int number) {
    TrialRecord record = exampleTrial();
    record.shard = number;
    record.shards = 2;
    auto& runs = record.results;
    runs.erase(std::remove_if(runs.begin(), runs.end(),
                              [number](const TrialRun& run) {
                                return (run.recording == "a") != (number == 1);
                              }),
               runs.end());
    record.sequences[number == 1 ? 1 : 0].content.clear();
    return record;
  }

  std::string mergeError() const {
    try {
      mergeTrials({out("1"), out("2")}, out("m"), false, nullptr);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "";
  }

  testing::TemporaryFolder folder_;
};

TEST_F(TrialStoreTest, ReadsBackWhatItWrote) {
  TrialRecord record = exampleTrial();
  record.protocol.from_s = {0.0, 12.5};
  for (TrialRun& run : record.results)
    if (run.from_s > 0.0) run.from_s = 12.5;
  record.systems = {{"theirs", "/there"}};
  write(out("x"), record);
  EXPECT_TRUE(isTrialFolder(out("x")));
  EXPECT_FALSE(isTrialFolder(out("y")));
  const TrialRecord read = readTrial(out("x"));
  EXPECT_EQ(runsCsv(read.results), runsCsv(record.results));
  EXPECT_EQ(differenceOf(read, record), "");
  EXPECT_EQ(read.protocol.from_s, record.protocol.from_s);
  EXPECT_EQ(missingResults(read).size(), 8U);  // of the system
  ASSERT_EQ(read.results.front().after_start.size(), timesAfterStart().size());
}

TEST_F(TrialStoreTest, KnowsWhatIsMissing) {
  TrialRecord record = exampleTrial();
  EXPECT_TRUE(missingResults(record).empty());
  const std::string key = resultKey(record.results[3]);
  EXPECT_EQ(key, "a, from 0 s, fixed_lag, two, dark");
  record.results.erase(record.results.begin() + 3);
  EXPECT_EQ(missingResults(record), std::vector<std::string>{key});
  record.sequences.front().error = "broken";
  EXPECT_TRUE(missingResults(record).empty());
}

TEST_F(TrialStoreTest, SaysHowTrialsDiffer) {
  const TrialRecord record = exampleTrial();
  const auto difference = [&record](const std::function<void(TrialRecord*)>& change) {
    TrialRecord other = record;
    change(&other);
    return differenceOf(record, other);
  };
  EXPECT_EQ(difference([](TrialRecord*) {}), "");
  EXPECT_THAT(difference([](TrialRecord* r) { r->protocol.seconds = 11.0; }),
              HasSubstr("--seconds"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->protocol.seed = 2; }), HasSubstr("seed"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->protocol.ate_limit_m = 0.1; }),
              HasSubstr("limit"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->faults[1].text = "frozen"; }),
              HasSubstr("faults"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->odometries = {"stereo_visual"}; }),
              HasSubstr("odometries"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->systems = {{"x", "/x"}}; }), HasSubstr("systems"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->config = "[input]\n"; }),
              HasSubstr("another configuration: '[pipeline]' and '[input]'"));
  EXPECT_THAT(difference([](TrialRecord* r) { r->initializers[0].binary = "x"; }),
              HasSubstr("build of the plugin 'one'"));
}

TEST_F(TrialStoreTest, JoinsShards) {
  write(out("1"), shard(1));
  write(out("2"), shard(2));
  const TrialOutcome outcome = mergeTrials({out("2"), out("1")}, out("m"), false, nullptr);
  EXPECT_EQ(outcome.runs_found, 16U);
  const TrialRecord merged = readTrial(out("m")), whole = exampleTrial();
  EXPECT_EQ(runsCsv(merged.results), runsCsv(whole.results));
  for (const TrialRun& run : merged.results)
    EXPECT_EQ(readTum(trajectoryPath(out("m"), merged, run)).size(), 1U);
  EXPECT_TRUE(fs::exists(out("m") + "/runs.csv"));
  EXPECT_EQ(merged.sequences[0].content, "content of a");
  EXPECT_THAT(mergeError(), HasSubstr("holds a trial already"));
}

TEST_F(TrialStoreTest, RefusesPartsThatDoNotFit) {
  write(out("1"), shard(1));
  TrialRecord two = shard(2);
  two.config = "[input]\n";
  write(out("2"), two);
  EXPECT_THAT(mergeError(), AllOf(HasSubstr("no parts of one trial"), HasSubstr("[input]")));
  two = shard(2);
  two.results.pop_back();
  fs::remove_all(out("2"));
  write(out("2"), two, false);
  EXPECT_THAT(mergeError(), AllOf(HasSubstr("1 runs are missing, the first: b, from 20.1 s"),
                                  HasSubstr("shard 2/2 ('" + out("2") + "')")));
  fs::remove_all(out("2"));
  write(out("2"), shard(1));
  EXPECT_THAT(mergeError(), HasSubstr("a run is there twice"));
}

TEST_F(TrialStoreTest, FindsTheTrajectoriesOfASystem) {
  TrialRecord record = exampleTrial();
  record.systems = {{"theirs", folder_.path()}};
  TrialRun run = testing::exampleRun("a", 0.0, {"theirs", "", "", ""}, kNoFault, 1.0);
  EXPECT_EQ(trajectoryPath("/out", record, run), out("a-0-none.tum"));
  folder_.write("a.tum", "");
  EXPECT_EQ(trajectoryPath("/out", record, run), out("a.tum"));
  run.from_s = 2.0;
  EXPECT_EQ(trajectoryPath("/out", record, run), out("a-2-none.tum"));
  run.variant = {"", "", "fixed_lag", "one"};
  EXPECT_EQ(trajectoryPath("/out", record, run), "/out/trajectories/fixed_lag-one/a-2-none.tum");
}

}  // namespace
}  // namespace etalon
