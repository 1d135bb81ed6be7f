#include "etalon/runlog/run_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CObservationStereoImages.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/testing/example_run.h"

namespace etalon {
namespace {

using namespace mrpt::obs;
using testing::ExampleRun;
using testing::exampleRun;
using testing::kFirstImage;

std::vector<CObservation::Ptr> observationsIn(const std::string& path) {
  mrpt::io::CFileGZInputStream stream;
  EXPECT_TRUE(stream.open(path));
  auto archive = mrpt::serialization::archiveFrom(stream);
  std::vector<CObservation::Ptr> observations;
  try {
    for (;;) observations.push_back(std::dynamic_pointer_cast<CObservation>(archive.ReadObject()));
  } catch (const std::exception&) {  // the end of the log
  }
  return observations;
}

TEST(RunLog, HoldsTheRunAsStockObservationsInTimeOrder) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / kRunLogName;
  const ExampleRun run = exampleRun();
  writeRunLog(path, run.log());

  const std::vector<CObservation::Ptr> observations = observationsIn(path);
  ASSERT_FALSE(observations.empty());
  EXPECT_NE(std::dynamic_pointer_cast<CObservationComment>(observations[0]), nullptr);
  std::map<std::string, int> counts;
  for (size_t i = 0; i < observations.size(); ++i) {
    ASSERT_NE(observations[i], nullptr);
    ++counts[observations[i]->sensorLabel];
    if (i > 0) {
      EXPECT_GE(observations[i]->timestamp, observations[i - 1]->timestamp);
    }
    const TimeNs t = fromMrptTime(observations[i]->timestamp);
    EXPECT_GE(t, truncateToMrptTick(kFirstImage));  // none carries the time of writing
    EXPECT_LE(t, kFirstImage + 500'000'001);
  }
  // 11 pairs less the one without a path; 3 keyframes a stage; ground truth inside the run only.
  counts.erase(observations[0]->sensorLabel);
  const std::map<std::string, int> expected = {{"stereo", 10},
                                               {"eta/init", 3},
                                               {"eta/vi_ba", 3},
                                               {"eta/odometry", 11},
                                               {"ground_truth", 11}};
  EXPECT_EQ(counts, expected);
}

TEST(RunLog, PosesAndImagesAreWhatWasGiven) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / kRunLogName;
  const ExampleRun run = exampleRun();
  writeRunLog(path, run.log());
  size_t odometry = 0, images = 0;
  for (const CObservation::Ptr& observation : observationsIn(path)) {
    if (observation->sensorLabel == "eta/odometry") {
      const auto pose = std::dynamic_pointer_cast<CObservationRobotPose>(observation);
      ASSERT_NE(pose, nullptr);
      const FrameEstimate& given = run.estimates.at(odometry++);
      EXPECT_EQ(fromMrptTime(pose->timestamp), truncateToMrptTick(given.t));
      // MRPT keeps yaw, pitch and roll: a few roundings.
      const SE3 read = fromMrptPose(pose->pose.mean);
      EXPECT_LT((read.t - given.nav.T_WB.t).norm(), 1e-14);
      EXPECT_LT((read.R - given.nav.T_WB.R).norm(), 1e-14);
    } else if (observation->sensorLabel == "stereo") {
      const auto stereo = std::dynamic_pointer_cast<CObservationStereoImages>(observation);
      ASSERT_NE(stereo, nullptr);
      if (images == 5) ++images;
      const StereoReference& given = run.images.at(images++);
      EXPECT_TRUE(stereo->imageLeft.isExternallyStored());
      EXPECT_EQ(stereo->imageLeft.getExternalStorageFile(), given.left_path);
      EXPECT_EQ(stereo->imageRight.getExternalStorageFile(), given.right_path);
    }
  }
  EXPECT_EQ(odometry, 11u);
  EXPECT_EQ(images, 11u);
}

TEST(RunLog, GivesTheRecordBackFromFolderAndFile) {
  const testing::TemporaryFolder folder;
  const ExampleRun run = exampleRun();
  writeRunLog(folder / kRunLogName, run.log());
  for (const std::string& place : {folder.path(), (folder / kRunLogName).string()}) {
    const RunRecord record = readRunRecord(place);
    EXPECT_EQ(record.source, run.record.source);
    EXPECT_EQ(record.config, run.record.config);
    EXPECT_EQ(record.attempts.size(), 2u);
  }
}

TEST(RunLog, ARunThatNeverInitializedCanBeLoggedToo) {
  const testing::TemporaryFolder folder;
  ExampleRun run = exampleRun();
  run.record.attempts.resize(1);
  run.record.initialized_at.reset();
  run.estimates.clear();
  run.images.clear();
  run.ground_truth = {};
  writeRunLog(folder / kRunLogName, run.log());
  EXPECT_EQ(observationsIn(folder / kRunLogName).size(), 1u);
  EXPECT_EQ(readRunRecord(folder.path()).acceptedAttempt(), nullptr);
}

TEST(RunLog, SaysWhatIsMissing) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(readRunRecord(folder.path()), DataError);
  EXPECT_THROW(readRunRecord(folder / "missing.rawlog"), DataError);
  std::ofstream(folder / "text.rawlog") << "this is not a rawlog";
  EXPECT_THROW(readRunRecord(folder / "text.rawlog"), DataError);
  EXPECT_THROW(writeRunLog(folder / "no/such/run.rawlog", exampleRun().log()), DataError);
}

TEST(RunLog, ADamagedOneIsRefusedBeforeThereIsRoomForItsLengths) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / kRunLogName, name = "mrpt::obs::CObservationComment";
  writeRunLog(path, exampleRun().log());
  std::stringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  std::string damaged = text.str();
  damaged.replace(damaged.find(name) + name.size() + 1, 4, "\xff\xff\xff\x7f", 4);
  std::ofstream(path, std::ios::binary) << damaged;
  try {
    readRunRecord(path);
    FAIL() << "expected a DataError";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("more than the log can hold"));
  }
}

#ifdef ETALON_RAWLOG_EDIT
TEST(RunLog, RawlogEditReadsIt) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / kRunLogName, output = folder / "output.txt";
  writeRunLog(path, exampleRun().log());
  const std::string command =
      std::string(ETALON_RAWLOG_EDIT) + " --info -i '" + path + "' > '" + output + "' 2>&1";
  std::ostringstream text;
  const int status = std::system(command.c_str());
  text << std::ifstream(output).rdbuf();
  ASSERT_EQ(status, 0) << text.str();
  // 1 comment, 10 stereo pairs, 6 keyframes, 11 poses of odometry, 11 of ground truth.
  EXPECT_THAT(text.str(), ::testing::HasSubstr(": 39\n"));
  EXPECT_THAT(text.str(),
              ::testing::HasSubstr("eta/init, eta/odometry, eta/vi_ba, ground_truth, stereo"));
}
#endif

}  // namespace
}  // namespace etalon
