// The trial's engine on recordings of six pairs of images, which no initializer can start on: what is run, stored and resumed.
// Flights: tests/chain/trial_unittest.cpp.
#include "etalon/benchmark/trial/trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "etalon/core/errors.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace trial_stub {

/** Refuses, or ends its process. */
class StubInitializer : public Initializer {
  DEFINE_MRPT_OBJECT(StubInitializer, etalon::trial_stub)

 public:
  StubInitializer() = default;
  explicit StubInitializer(bool crashes) : crashes_(crashes) {}
  void declareParameters(ParameterSet&) override {}
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem&) const override {
    if (crashes_) std::_Exit(3);
    return refuse({RefusalStatus::kTooFewTracks, "of a reason", {}, {}});
  }

 private:
  bool crashes_ = false;
};

}  // namespace trial_stub
}  // namespace etalon

IMPLEMENTS_MRPT_OBJECT(StubInitializer, etalon::Initializer, etalon::trial_stub)

namespace etalon {
namespace {

using trial_stub::StubInitializer;

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class TrialTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    recordings_ = new testing::TemporaryFolder();
    for (const char* name : {"a", "b"}) {
      fs::create_directories(*recordings_ / name);
      testing::writeTinyRecording(*recordings_ / name);
    }
  }
  static void TearDownTestSuite() { delete recordings_; }

  std::string out(const std::string& name) const { return folder_ / name; }
  static std::vector<std::string> sources() { return {(*recordings_ / "a"), (*recordings_ / "b")}; }

  /** Windows of two keyframes at 20 Hz. */
  static std::vector<TrialSetting> settings(bool crashes = false) {
    TrialSetting setting;
    setting.configuration.pipeline.min_keyframes = setting.configuration.pipeline.keyframes = 2;
    setting.configuration.pipeline.keyframe_rate_hz = 20.0;
    for (const char* name : {"one", "two"}) {
      ConfiguredInitializer initializer;
      initializer.plugin.name = name;
      initializer.plugin.path = "/proc/self/exe";
      const bool dies = crashes && std::string(name) == "two";
      initializer.initializer = std::make_shared<StubInitializer>(dies);
      setting.configuration.initializers.push_back(initializer);
    }
    return {setting};
  }

  TrialOptions options(const std::string& name) const {
    TrialOptions options;
    options.sources = sources();
    options.out = out(name);
    options.protocol.seconds = 0.0;
    options.protocol.from_s = {0.0, 0.05};
    options.faults = {parseFaultScenario("dark", "covered from=0.1 for=0.1"),
                      parseFaultScenario("gap", "dropped from=0.1 for=0.05"),
                      parseFaultScenario("wrong", "calibration baseline_percent=1")};
    return options;
  }

  /** runs.csv without its times. */
  static std::string runsOf(TrialRecord record) {
    for (TrialRun& run : record.results) run.frame_ms = 0.0;
    return runsCsv(record.results);
  }
  std::string whyNot(const TrialOptions& options) const {
    try {
      runTrial(settings(), options);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "";
  }

  static testing::TemporaryFolder* recordings_;
  testing::TemporaryFolder folder_;
};
testing::TemporaryFolder* TrialTest::recordings_ = nullptr;

TEST_F(TrialTest, RunsEverythingAndSaysWhyItFailed) {
  const TrialOutcome outcome = runTrial(settings(), options("x"));
  EXPECT_EQ(outcome.runs_made, 2U * 2U * 2U * 4U);
  EXPECT_FALSE(outcome.interrupted);
  EXPECT_EQ(outcome.record.faults.front().name, kNoFault);
  for (const TrialRun& run : outcome.record.results) {
    EXPECT_EQ(run.status, kStatusFailed) << resultKey(run);
    EXPECT_THAT(run.reason, StartsWith("never started"));
    EXPECT_EQ(run.images, run.from_s > 0.0 ? 5 : 6);
    EXPECT_EQ(run.frames, run.images - (run.fault == "gap" ? 1 : 0)) << resultKey(run);
    EXPECT_EQ(std::isnan(run.fault_at_s), run.fault == kNoFault);
    EXPECT_TRUE(fs::exists(trajectoryPath(out("x"), outcome.record, run))) << resultKey(run);
  }
  EXPECT_TRUE(fs::exists(out("x") + "/runs.csv"));
  EXPECT_EQ(runsOf(readTrial(out("x"))), runsOf(outcome.record));
}

TEST_F(TrialTest, GivesTheSameWhateverTheJobsAndWhateverWasThere) {
  const std::string whole = runsOf(runTrial(settings(), options("x")).record);
  TrialOptions three = options("y");
  three.jobs = 3;
  EXPECT_EQ(runsOf(runTrial(settings(), three).record), whole);
  // As if it had been killed in the middle of a line.
  const std::string file = out("y") + "/runs/a.jsonl";
  fs::resize_file(file, fs::file_size(file) / 2);
  const TrialOutcome resumed = runTrial(settings(), three);
  EXPECT_GT(resumed.runs_found, 16U);
  EXPECT_GT(resumed.runs_made, 0U);
  EXPECT_EQ(runsOf(resumed.record), whole);
  EXPECT_EQ(runTrial(settings(), three).runs_made, 0U);
}

TEST_F(TrialTest, StopsBetweenTasksAndGoesOn) {
  std::atomic<bool> stop{false};
  TrialOptions stopped = options("x");
  stopped.stop = &stop;
  stopped.progress = [&stop](const BenchmarkProgress& p) { stop = p.done >= 2; };
  const TrialOutcome first = runTrial(settings(), stopped);
  EXPECT_TRUE(first.interrupted);
  EXPECT_GT(first.runs_missing, 0U);
  EXPECT_FALSE(fs::exists(out("x") + "/runs.csv"));
  const TrialOutcome second = runTrial(settings(), options("x"));
  EXPECT_EQ(second.runs_found, first.runs_made);
  EXPECT_EQ(runsOf(second.record), runsOf(runTrial(settings(), options("y")).record));
}

TEST_F(TrialTest, ShardsMakeTheWhole) {
  for (const int shard : {1, 2, 3}) {
    TrialOptions part = options(std::to_string(shard));
    part.shard = shard;
    part.shards = 3;
    runTrial(settings(), part);
  }
  const TrialOutcome merged = mergeTrials({out("1"), out("2"), out("3")}, out("m"), false, nullptr);
  EXPECT_EQ(runsOf(merged.record), runsOf(runTrial(settings(), options("x")).record));
}

TEST_F(TrialTest, ACrashLosesItsOwnRunAlone) {
  std::set<std::string> warnings;
  TrialOptions with_warnings = options("x");
  with_warnings.warn = [&](const std::string& sentence) { warnings.insert(sentence); };
  const TrialRecord record = runTrial(settings(true), with_warnings).record;
  EXPECT_EQ(record.results.size(), 32U);
  for (const TrialRun& run : record.results) {
    if (run.variant.initializer == "one") {
      EXPECT_EQ(run.status, kStatusFailed);
      continue;
    }
    EXPECT_EQ(run.status, kStatusCrashed) << resultKey(run);
    EXPECT_EQ(run.reason, "ended the process with exit code 3");
    EXPECT_EQ(run.frames, run.images);  // frames without a pose, which lower the coverage
    EXPECT_EQ(warnings.count(resultKey(run) + ": " + run.reason), 1U);
  }
}

TEST_F(TrialTest, RefusesAFolderOfAnotherTrial) {
  runTrial(settings(), options("x"));
  TrialOptions other = options("x");
  other.protocol.seed = 2;
  EXPECT_THAT(whyNot(other), HasSubstr("another seed; choose another --out"));
  other.overwrite = true;
  EXPECT_EQ(whyNot(other), "");
}

TEST_F(TrialTest, RefusesNamesThatAreThereTwice) {
  TrialOptions twice = options("x");
  twice.faults.push_back(twice.faults.front());
  EXPECT_THAT(whyNot(twice), HasSubstr("two faults are called 'dark'"));
  twice = options("x");
  twice.faults.push_back(parseFaultScenario(kNoFault, "covered"));
  EXPECT_THAT(whyNot(twice), HasSubstr("'none' has a fault"));
  twice = options("x");
  twice.systems = {{"theirs", out("nothing")}};
  EXPECT_THAT(whyNot(twice), HasSubstr("no folder"));
  twice = options("x");
  twice.protocol.from_s = {0.0, 0.05, 0.05};
  EXPECT_THAT(whyNot(twice), HasSubstr("two instants (--from) are called '0.05 s'"));
  twice = options("x");
  twice.odometries = {"fixed_lag", "fixed_lag"};
  EXPECT_THAT(whyNot(twice), HasSubstr("two odometries are called 'fixed_lag'"));
  twice = options("x");
  twice.systems = {{"two", folder_.path()}};
  EXPECT_THAT(whyNot(twice), HasSubstr("the system 'two' is called like an initializer"));
}

TEST_F(TrialTest, RefusesToRunNothing) {
  TrialOptions long_runs = options("x");
  long_runs.protocol.from_s.clear();
  long_runs.protocol.seconds = 12.0;
  EXPECT_THAT(whyNot(long_runs), HasSubstr("no run is left: a: too short for runs of 12 s"));
  EXPECT_FALSE(fs::exists(out("x")));
}

TEST_F(TrialTest, ARecordingThatCannotBeReadIsNamed) {
  TrialOptions one = options("x");
  one.sources.push_back(out("nothing"));
  const TrialOutcome outcome = runTrial(settings(), one);
  EXPECT_EQ(outcome.runs_made, 32U);
  EXPECT_NE(outcome.record.sequences.back().error, "");
}

TEST_F(TrialTest, JudgesTrajectoriesOfOthersAlike) {
  TrialOptions with_system = options("x");
  with_system.sources.resize(1);
  with_system.protocol.from_s = {0.0};
  with_system.systems = {{"theirs", out("theirs")}};
  fs::create_directories(out("theirs"));
  Trajectory truth;
  for (int i = 0; i < testing::kFrames; ++i) truth.push_back({testing::frameStamp(i), SE3()});
  writeTum(out("theirs") + "/a-0-gap.tum", truth);
  folder_.write("theirs/a-0-dark.tum", "1 2 3\n");
  const TrialRecord record = runTrial(settings(), with_system).record;
  ASSERT_EQ(record.results.size(), 12U);
  const auto run = [&record](const std::string& fault) {
    for (const TrialRun& r : record.results)
      if (r.variant.system == "theirs" && r.fault == fault) return r;
    return TrialRun();
  };
  EXPECT_THAT(run(kNoFault).reason, HasSubstr("no trajectory 'a-0-none.tum'"));
  EXPECT_EQ(run(kNoFault).coverage(), 0.0);
  EXPECT_THAT(run("dark").reason, HasSubstr("a-0-dark.tum:1"));
  EXPECT_EQ(run("gap").poses, 5);  // of the five frames that the fault left
  EXPECT_EQ(run("gap").coverage(), 1.0);
  EXPECT_EQ(run("gap").frames, 5);
}

}  // namespace
}  // namespace etalon
