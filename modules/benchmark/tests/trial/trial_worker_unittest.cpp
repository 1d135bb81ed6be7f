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
    options_.faults = {parseFaultScenario(kNoFault, ""),
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

  /** The trajectory file of a flight that is fed from the beginning to the end. */
  std::string flownAlone(const FaultScenario& fault) const {
    const std::unique_ptr<SensorSource> source =
        withFaults(openSource(folder_ / "tiny"), fault, 0.0, options_.protocol.seed);
    PipelineInitializers initializers;
    initializers.name = "none";
    TrialFlight flight(source->calibration(), settings_[0].configuration.pipeline, initializers);
    while (const auto event = source->next()) flight.feed(*event);
    writeTum(folder_ / "alone.tum", flight.finish().causal);
    return testing::readText(folder_ / "alone.tum");
  }

  testing::TemporaryFolder folder_;
  std::vector<TrialSetting> settings_;
  TrialOptions options_;
  TrialRecord record_;
  TrialTask task_;
};

TEST_F(TrialWorkerTest, FliesInTheOrderOfWhatIsShared) {
  EXPECT_THAT(faultsOf(run()), ElementsAre("wrong", "early", "late", "never", kNoFault));
  EXPECT_THAT(faultsOf(run(3)), ElementsAre("never", kNoFault));
}

TEST_F(TrialWorkerTest, SharingChangesNothing) {
  const auto shared = trajectories(run());
  for (const FaultScenario& fault : options_.faults)
    EXPECT_EQ(flownAlone(fault), shared.at(fault.name)) << fault.name;
}

TEST_F(TrialWorkerTest, WhatIsMissingIsMadeAlike) {
  const std::vector<TrialRun> all = run();
  task_.faults = {1, 3};
  const std::vector<TrialRun> resumed = run();
  ASSERT_THAT(faultsOf(resumed), ElementsAre("wrong", "late"));
  EXPECT_EQ(resultToText(resumed[0]), resultToText(all[0]));
  EXPECT_EQ(resultToText(resumed[1]), resultToText(all[2]));
}

TEST_F(TrialWorkerTest, AFaultThatComesTooLateIsNone) {
  const std::vector<TrialRun> runs = run();
  EXPECT_EQ(runs[3].fault, "never");
  EXPECT_TRUE(std::isnan(runs[3].fault_at_s));
  EXPECT_EQ(runs[3].status, kStatusFaultNotMet);
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
