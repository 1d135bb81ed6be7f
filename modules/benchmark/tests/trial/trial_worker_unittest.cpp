// Runs that share what comes before a fault are those that do not.
#include "trial/trial_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "etalon/core/output_file.h"
#include "etalon/testing/tiny_recording.h"
#include "suite/open_recordings.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::StartsWith;

/** A task on the recording of six pairs of images; stereo odometry alone, nothing starts. */
class TrialWorkerTest : public ::testing::Test {
 protected:
  TrialWorkerTest() {
    testing::writeTinyRecording(folder_ / "tiny");
    openRecordings({folder_ / "tiny"}, "", &record_.sequences);
    options_.out = folder_ / "out";
    options_.protocol.seconds = 0.0;
    options_.faults = {FaultScenario{kNoFault, "", {}},
                       parseFaultScenario("late", "covered from=0.2"),
                       parseFaultScenario("early", "dropped from=0.05 for=0.05"),
                       parseFaultScenario("wrong", "calibration baseline_percent=1"),
                       parseFaultScenario("never", "covered from=9")};
    for (const FaultScenario& fault : options_.faults)
      record_.faults.push_back({fault.name, fault.text});
    TrialSetting setting;
    ConfiguredInitializer initializer;
    initializer.plugin.name = "none";  // is never asked: the window is longer than the recording
    setting.configuration.initializers = {initializer};
    settings_ = {setting};
    task_.variant = {"", "", "fixed_lag", "none"};
    task_.faults = {0, 1, 2, 3, 4};
    makeFolder(folder_ / "out/trajectories/fixed_lag-none");
    makeFolder(folder_ / "out/trajectories/ground_truth");
  }

  std::vector<TrialRun> run(size_t first = 0) {
    TrialWorker worker(settings_, options_, record_);
    std::vector<TrialRun> runs;
    size_t expected = first;
    worker.run(task_, first, [&](size_t part, const std::function<std::string()>& answer) {
      EXPECT_EQ(part, expected++);
      runs.push_back(trialRunFromText(answer()));
      runs.back().frame_ms = 0.0;
    });
    return runs;
  }
  static std::vector<std::string> faultsOf(const std::vector<TrialRun>& runs) {
    std::vector<std::string> faults;
    for (const TrialRun& run : runs) faults.push_back(run.fault);
    return faults;
  }
  std::map<std::string, std::string> trajectories(const std::vector<TrialRun>& runs) const {
    std::map<std::string, std::string> texts;
    for (const TrialRun& run : runs)
      texts[run.fault] = testing::readText(trajectoryPath(options_.out, record_, run));
    return texts;
  }

  testing::TemporaryFolder folder_;
  std::vector<TrialSetting> settings_;
  TrialOptions options_;
  TrialRecord record_;
  TrialTask task_;
};

TEST_F(TrialWorkerTest, FliesInTheOrderOfWhatIsShared) {
  EXPECT_THAT(faultsOf(run()), ElementsAre(kNoFault, "wrong", "early", "late", "never"));
  EXPECT_THAT(faultsOf(run(3)), ElementsAre("late", "never"));
}

TEST_F(TrialWorkerTest, SharingChangesNothing) {
  const std::vector<TrialRun> shared = run();
  const auto shared_trajectories = trajectories(shared);
  // Without the run that has no fault nothing is known to be sound, and every run flies alone.
  task_.faults = {1, 2, 3, 4};
  const std::vector<TrialRun> alone = run();
  const auto alone_trajectories = trajectories(alone);
  ASSERT_EQ(alone.size(), 4U);
  for (size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(resultToText(alone[i]), resultToText(shared[i + 1]));
    EXPECT_EQ(alone_trajectories.at(alone[i].fault), shared_trajectories.at(alone[i].fault));
  }
  // Where it is on disk already, it is.
  task_.plain_is_sound = true;
  const std::vector<TrialRun> resumed = run();
  for (size_t i = 0; i < alone.size(); ++i)
    EXPECT_EQ(resultToText(alone[i]), resultToText(resumed[i]));
}

TEST_F(TrialWorkerTest, AFaultThatComesTooLateIsNone) {
  const std::vector<TrialRun> runs = run();
  EXPECT_TRUE(std::isnan(runs.back().fault_at_s));
  const auto texts = trajectories(runs);
  EXPECT_EQ(texts.at("never"), texts.at(kNoFault));
  EXPECT_NE(texts.at("late"), "");
}

TEST_F(TrialWorkerTest, GroundTruthStandsBesideTheTrajectories) {
  run();
  const Trajectory truth = readTum(groundTruthPath(options_.out, "tiny", 0.0));
  ASSERT_EQ(truth.size(), static_cast<size_t>(testing::kFrames));
}

TEST_F(TrialWorkerTest, ARecordingThatBreaksFailsItsRuns) {
  record_.sequences[0].source = folder_ / "nothing";
  const std::vector<TrialRun> runs = run();
  ASSERT_EQ(runs.size(), 5U);
  for (const TrialRun& run : runs) {
    EXPECT_EQ(run.status, kStatusFailed);
    EXPECT_NE(run.reason, "");
  }
}

}  // namespace
}  // namespace etalon
