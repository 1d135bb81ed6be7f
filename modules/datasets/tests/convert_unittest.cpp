// Conversions to a EuRoC folder and to a ROS 1 bag; those to a rawlog are in rawlog_unittest.cpp.

#include "etalon/datasets/convert.h"

#include <gmock/gmock.h>

#include "etalon/core/errors.h"
#include "etalon/datasets/sensor_yaml_text.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::HasSubstr;

class Convert : public ::testing::Test {
 protected:
  Convert() { writeTinyRecording(euroc_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::unique_ptr<SensorSource> source(bool decode = true) const {
    return openWhole(euroc_.string(), decode);
  }

  TemporaryFolder folder_;
  const fs::path euroc_ = folder_ / "recording";
};

/** Delivers what a source does, until it fails. */
class FailingSource : public SensorSource {
 public:
  FailingSource(std::unique_ptr<SensorSource> source, int events)
      : source_(std::move(source)), left_(events) {}
  const std::string& name() const override { return source_->name(); }
  std::string kind() const override { return source_->kind(); }
  const StereoInertialCalibration& calibration() const override { return source_->calibration(); }
  const GroundTruth& groundTruth() const override { return source_->groundTruth(); }
  const std::vector<TimeNs>& imageStamps() const override { return source_->imageStamps(); }
  std::optional<SensorEvent> next() override {
    if (left_-- == 0) throw DataError("the disk", 0, "is gone");
    return source_->next();
  }
  const ReadStatistics& statistics() const override { return source_->statistics(); }

 private:
  std::unique_ptr<SensorSource> source_;
  int left_;
};

TEST_F(Convert, AFolderHoldsTheSame) {
  const ConvertReport report = convertToEuroc(*source(), path("copy"));
  EXPECT_EQ(report.stereo_frames, kFrames);
  EXPECT_FALSE(report.embedded);
  const auto before = source(), after = openWhole(path("copy"));
  expectSameRecording(*before, *after);
  EXPECT_TRUE(after->groundTruth().has_biases);
  EXPECT_THAT(readText(folder_ / "copy/mav0/imu0/sensor.yaml"), HasSubstr(euroc_.string()));
}

TEST_F(Convert, AFolderOfAPartHoldsThePart) {
  SourceOptions options;
  options.from_s = 0.1;
  convertToEuroc(*openSource(euroc_.string(), options), path("part"));
  const auto part = openWhole(path("part"));
  EXPECT_EQ(part->imageStamps().front(), frameStamp(2));
  EXPECT_EQ(part->imageStamps().size(), static_cast<size_t>(kFrames - 2));
}

TEST_F(Convert, AFolderWithoutGroundTruthHasNone) {
  fs::remove_all(euroc_ / "mav0/state_groundtruth_estimate0");
  EXPECT_EQ(convertToEuroc(*source(), path("copy")).ground_truth_poses, 0);
  EXPECT_TRUE(openWhole(path("copy"))->groundTruth().empty());
}

TEST_F(Convert, GroundTruthOfPosesStaysOfPoses) {
  const fs::path truth = euroc_ / "mav0/state_groundtruth_estimate0/data.csv";
  writeText(truth, std::to_string(frameStamp(0)) + ",1,2,3,0.6,0.8,0,0\n" +
                       std::to_string(frameStamp(1)) + ",1,2,4,0.6,0,0.8,0\n");
  convertToEuroc(*source(), path("copy"));
  const GroundTruth copied = openWhole(path("copy"))->groundTruth();
  ASSERT_EQ(copied.states.size(), 2u);
  EXPECT_FALSE(copied.has_velocity);
  EXPECT_EQ(copied.states[1].T_WB.t, Eigen::Vector3d(1, 2, 4));
}

TEST_F(Convert, WhatOfTheGroundTruthIsLostIsReported) {
  EXPECT_EQ(convertToEuroc(*source(), path("whole")).lost_truth, "");
  EXPECT_EQ(convertToRosBag(*source(), path("copy.bag")).lost_truth, "velocities and biases");
  EXPECT_EQ(convertToRawlog(*source(), path("log.rawlog"), {true, {}}).lost_truth, "");
  // Seen from elsewhere on the body the velocity is not known, and so the biases have no columns.
  const fs::path yaml = euroc_ / "mav0/state_groundtruth_estimate0/sensor.yaml";
  writeText(yaml, poseYaml("visual-inertial", "elsewhere",
                           SE3(Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0})));
  EXPECT_EQ(convertToEuroc(*source(), path("poses")).lost_truth, "biases");
  EXPECT_FALSE(openWhole(path("poses"))->groundTruth().has_biases);
}

TEST_F(Convert, PixelsAreNeeded) {
  EXPECT_THROW(convertToEuroc(*source(false), path("copy")), ConfigError);
  EXPECT_THROW(convertToRosBag(*source(false), path("copy.bag")), ConfigError);
  EXPECT_THROW(convertToRos2Bag(*source(false), path("copy.db3")), ConfigError);
}

TEST_F(Convert, WhatIsInterruptedLeavesNothing) {
  for (const int events : {0, 30}) {
    FailingSource folder(source(), events), bag(source(), events), bag2(source(), events);
    EXPECT_THROW(convertToEuroc(folder, path("copy")), DataError);
    EXPECT_TRUE(fs::is_empty(folder_ / "copy/mav0"));
    fs::remove_all(folder_ / "copy");
    EXPECT_THROW(convertToRosBag(bag, path("copy.bag")), DataError);
    EXPECT_THROW(convertToRos2Bag(bag2, path("copy.db3")), DataError);
    for (const char* file : {"copy.bag", "copy.db3", "metadata.yaml", "camchain.yaml"})
      EXPECT_FALSE(fs::exists(path(file))) << file;
  }
}

TEST_F(Convert, WhatCannotBeWrittenIsSaid) {
  writeText(folder_ / "file", "of mine");
  EXPECT_THROW(convertToEuroc(*source(), path("file")), ConfigError);
  EXPECT_THROW(convertToEuroc(*source(), path("file/below")), DataError);
  EXPECT_THROW(convertToRosBag(*source(), path("file/below.bag")), DataError);
  EXPECT_THROW(convertToRos2Bag(*source(), path("file/below.db3")), DataError);
  EXPECT_EQ(readText(folder_ / "file"), "of mine");
}

TEST_F(Convert, ProgressReachesItsEnd) {
  for (const bool bag : {false, true}) {
    std::vector<int> frames;
    ConvertOptions options;
    options.progress = [&](const ConvertProgress& progress) {
      EXPECT_EQ(progress.frames_total, kFrames);
      frames.push_back(progress.frames);
    };
    if (bag)
      convertToRosBag(*source(), path("copy.bag"), options);
    else
      convertToEuroc(*source(), path("copy"), options);
    EXPECT_EQ(frames, (std::vector<int>{1, 2, 3, 4, 5, 6}));
  }
}

TEST_F(Convert, ARawlogHasNoUseForOptions) {
  ConvertOptions embed;
  embed.embed = true;
  convertToRawlog(*source(), path("log.rawlog"), embed);
  const auto refusal = [&](const RecordingOptions& recording) -> std::string {
    SourceOptions options;
    options.recording = recording;
    try {
      openSource(path("log.rawlog"), options);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal({}), "accepted");
  RecordingOptions options;
  options.camchain = "chain.yaml";
  EXPECT_THAT(refusal(options), HasSubstr("a rawlog has no use for the calibration 'chain.yaml'"));
  options = {};
  options.imu_yaml = "imu.yaml";
  EXPECT_THAT(refusal(options), HasSubstr("'imu.yaml'; expected it with a folder or a bag"));
  options = {};
  options.pair_tolerance_s = 1e-3;
  EXPECT_THAT(refusal(options), HasSubstr("no use for a tolerance of pairs"));
  options = {};
  options.truth_topic = "/pose";
  EXPECT_THAT(refusal(options), HasSubstr("the topic '/pose'; expected it with a bag only"));
}

}  // namespace
}  // namespace etalon::testing
