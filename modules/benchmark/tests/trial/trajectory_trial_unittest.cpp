#include "etalon/benchmark/trial/trajectory_trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/core/errors.h"
#include "etalon/runlog/initialization_json.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class TrajectoryTrialTest : public ::testing::Test {
 protected:
  TrajectoryTrialTest() {
    testing::writeTinyRecording(folder_ / "tiny");
    for (const char* system : {"ours", "theirs"})
      std::filesystem::create_directories(folder_ / system);
  }

  /** Writes poses of the images from `first` on, without errors. */
  void write(const std::string& file, int first) const {
    SourceOptions options;
    options.decode_images = false;
    const GroundTruth truth = openSource(folder_ / "tiny", options)->groundTruth();
    Trajectory trajectory;
    for (int i = first; i < testing::kFrames; ++i)
      trajectory.push_back({testing::frameStamp(i), truth.at(testing::frameStamp(i))->T_WB});
    writeTum(folder_ / file, trajectory);
  }
  TrialRecord judged(const std::vector<NamedText>& systems) const {
    return trialOfTrajectories(systems, {folder_ / "tiny"}, TrialProtocol());
  }

  testing::TemporaryFolder folder_;
};

TEST_F(TrajectoryTrialTest, NamesTellSystemsApart) {
  write("ours/tiny.tum", 0);
  EXPECT_THROW(judged({{"a", folder_ / "ours"}, {"a", folder_ / "ours/tiny.tum"}}), ConfigError);
}

TEST_F(TrajectoryTrialTest, HoldsSystemsAgainstTheSameImages) {
  write("ours/tiny.tum", 0);
  write("theirs/tiny.tum", 2);
  write("theirs/tiny-0.05-dark.tum", 1);
  write("theirs/other.tum", 0);  // of no recording given
  const TrialRecord record = judged({{"ours", folder_ / "ours"}, {"theirs", folder_ / "theirs"}});
  ASSERT_EQ(record.results.size(), 4U);
  const TrialRun &ours = record.results[0], &theirs = record.results[1];
  EXPECT_EQ(ours.variant.system, "ours");
  EXPECT_EQ(ours.frames, 6);
  EXPECT_EQ(ours.coverage(), 1.0);
  EXPECT_LT(ours.causal.ate_m, 1e-6);  // TUM files have nine decimals
  EXPECT_EQ(theirs.frames, 6);
  EXPECT_DOUBLE_EQ(theirs.coverage(), 4.0 / 6.0);
  EXPECT_NEAR(theirs.started_s, 0.1, 1e-6);
  // Of the part only one of them has a file.
  EXPECT_EQ(record.results[2].fault, "dark");
  EXPECT_EQ(record.results[2].reason, "there is no trajectory of it");
  EXPECT_EQ(record.results[2].coverage(), 0.0);
  EXPECT_EQ(record.results[3].frames, 5);
  EXPECT_EQ(record.results[3].coverage(), 1.0);
  EXPECT_EQ(record.faults.back().name, "dark");
  // The recording is flown without a fault, and the part with one.
  EXPECT_THAT(
      missingResults(record),
      UnorderedElementsAre("tiny, from 0 s, ours, dark", "tiny, from 0 s, theirs, dark",
                           "tiny, from 0.05 s, ours, none", "tiny, from 0.05 s, theirs, none"));
}

TEST_F(TrajectoryTrialTest, FindsTheTrajectoriesOfARecordingWhoseNameHasABlank) {
  write("tiny.tum", 0);
  std::filesystem::copy_file(folder_ / "tiny.tum", folder_ / "theirs/my flight.tum");
  std::filesystem::copy_file(folder_ / "tiny.tum",
                             folder_ / "ours" / trajectoryName("my flight", 0.0, kNoFault));
  std::filesystem::rename(folder_ / "tiny", folder_ / "my flight");
  const TrialRecord record =
      trialOfTrajectories({{"ours", folder_ / "ours"}, {"theirs", folder_ / "theirs"}},
                          {folder_ / "my flight"}, TrialProtocol());
  ASSERT_EQ(record.results.size(), 2U);
  for (const TrialRun& run : record.results) EXPECT_EQ(run.poses, 6) << resultKey(run);
  std::filesystem::copy(folder_ / "my flight", folder_ / "my_flight",
                        std::filesystem::copy_options::recursive);
  EXPECT_THROW(trialOfTrajectories({{"ours", folder_ / "ours"}},
                                   {folder_ / "my flight", folder_ / "my_flight"}, TrialProtocol()),
               ConfigError);
}

TEST_F(TrajectoryTrialTest, OneFileOfOneRecordingMayHaveAnyName) {
  write("x.tum", 0);
  const TrialRecord record = judged({{"x", folder_ / "x.tum"}});
  ASSERT_EQ(record.results.size(), 1U);
  EXPECT_EQ(record.results.front().poses, 6);
}

TEST_F(TrajectoryTrialTest, ARunOfAPartIsHeldAgainstThatPart) {
  write("ours/trajectory.tum", 2);
  RunRecord run;
  run.first_image = testing::frameStamp(2);
  run.statistics.duration_s =
      secondsBetween(run.first_image, testing::frameStamp(testing::kFrames - 1));
  writeInitializationJson(folder_ / "ours/initialization.json", run);
  TrialRecord record = judged({{"ours", folder_ / "ours/trajectory.tum"}});
  ASSERT_EQ(record.results.size(), 1U);
  EXPECT_EQ(record.results[0].frames, 4);
  EXPECT_EQ(record.results[0].coverage(), 1.0);
  EXPECT_NEAR(record.results[0].from_s, 0.1, 1e-6);
  // Beside one of the whole it is held against its own part still.
  write("theirs.tum", 0);
  record = judged({{"ours", folder_ / "ours/trajectory.tum"}, {"theirs", folder_ / "theirs.tum"}});
  ASSERT_EQ(record.results.size(), 2U);
  EXPECT_EQ(record.results[0].frames, 6);
  EXPECT_EQ(record.results[1].frames, 4);
  // Of the whole recording, though its first images show nothing of the pose.
  run.first_image = testing::frameStamp(0);
  run.statistics.duration_s =
      secondsBetween(run.first_image, testing::frameStamp(testing::kFrames - 1));
  writeInitializationJson(folder_ / "ours/initialization.json", run);
  record = judged({{"ours", folder_ / "ours/trajectory.tum"}});
  EXPECT_EQ(record.results.front().frames, 6);
  // Of another recording.
  run.first_image = 1;
  writeInitializationJson(folder_ / "ours/initialization.json", run);
  record = judged({{"ours", folder_ / "ours/trajectory.tum"}});
  EXPECT_EQ(record.results.front().frames, 6);
}

TEST_F(TrajectoryTrialTest, AFolderWithoutTrajectoriesIsRefused) {
  try {
    judged({{"ours", folder_ / "ours"}});
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("RECORDING-FROM-FAULT.tum"));
  }
}

}  // namespace
}  // namespace etalon
