// Bags of ROS 1, written by rosbag_storage.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <std_msgs/Header.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

#include "etalon/core/errors.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Ros1Bag : public ::testing::Test {
 protected:
  Ros1Bag() { writeTinyRecording(euroc_); }

  void convertThere() const { convertToRosBag(*openWhole(euroc_.string()), bag_); }

  TemporaryFolder folder_;
  const fs::path euroc_ = folder_ / "recording";
  const std::string bag_ = (folder_ / "flight.bag").string();
};

TEST_F(Ros1Bag, HoldsTheRecordingAndComesBack) {
  const ConvertReport report = convertToRosBag(*openWhole(euroc_.string()), bag_);
  EXPECT_EQ(report.stereo_frames, kFrames);
  const auto before = openWhole(euroc_.string()), after = openWhole(bag_);
  EXPECT_EQ(after->kind(), "rosbag");
  EXPECT_THAT(after->statistics().warnings, IsEmpty());
  EXPECT_EQ(after->imageStamps(), before->imageStamps());
  const auto events = readAll(*after), expected = readAll(*before);
  ASSERT_EQ(events.size(), expected.size());
  const auto imu = imuOf(events), expected_imu = imuOf(expected);
  for (size_t i = 0; i < imu.size(); ++i) {
    EXPECT_EQ(imu[i].t, expected_imu[i].t);
    EXPECT_EQ(imu[i].gyro, expected_imu[i].gyro);
    EXPECT_EQ(imu[i].accel, expected_imu[i].accel);
  }
  const auto frames = framesOf(events), expected_frames = framesOf(expected);
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  for (size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].t, expected_frames[i].t);
    EXPECT_EQ(cv::norm(frames[i].left, expected_frames[i].left, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(frames[i].right, expected_frames[i].right, cv::NORM_INF), 0.0);
  }
  for (size_t c = 0; c < 2; ++c) {
    const CameraCalibration& camera = after->calibration().cameras[c];
    const CameraCalibration& wanted = before->calibration().cameras[c];
    EXPECT_EQ(camera.model, wanted.model);
    // Inverted twice.
    EXPECT_LT((camera.T_BC.matrix() - wanted.T_BC.matrix()).norm(), 1e-12);
  }
  EXPECT_EQ(after->calibration().imu.noise.gyro_random_walk,
            before->calibration().imu.noise.gyro_random_walk);
  const auto& states = after->groundTruth().states;
  const auto& expected_states = before->groundTruth().states;
  ASSERT_EQ(states.size(), expected_states.size());
  EXPECT_FALSE(after->groundTruth().has_velocity);
  for (size_t i = 0; i < states.size(); ++i) {
    EXPECT_EQ(states[i].t, expected_states[i].t);
    // By way of a quaternion.
    EXPECT_LT((states[i].T_WB.matrix() - expected_states[i].T_WB.matrix()).norm(), 1e-12);
  }
}

TEST_F(Ros1Bag, GoesToAEurocFolderAndARawlog) {
  convertThere();
  const std::string euroc = (folder_ / "again").string(), log = (folder_ / "log.rawlog").string();
  convertToEuroc(*openWhole(bag_), euroc);
  const auto from_bag = openWhole(bag_), from_folder = openWhole(euroc);
  expectSameRecording(*from_bag, *from_folder);
  ConvertOptions embed;
  embed.embed = true;
  convertToRawlog(*openWhole(bag_), log, embed);
  const auto bag_again = openWhole(bag_), from_log = openWhole(log);
  expectSameRecording(*bag_again, *from_log);
  EXPECT_THROW(convertToEuroc(*openWhole(bag_), euroc), ConfigError);  // it is not empty
}

TEST_F(Ros1Bag, DoesNotTakeThePlaceOfAnotherCalibration) {
  convertThere();
  convertThere();  // the same again is no harm
  replaceInFile(folder_ / "camchain.yaml", "timeshift_cam_imu: 0.0", "timeshift_cam_imu: 0.1");
  EXPECT_THROW(convertThere(), ConfigError);
}

TEST_F(Ros1Bag, SaysWhereItLooksForACalibration) {
  convertThere();
  fs::rename(folder_ / "imu.yaml", folder_ / "other.yaml");
  EXPECT_THAT(openSource(bag_)->statistics().warnings,
              ::testing::ElementsAre(HasSubstr("there is no imu.yaml of Kalibr beside the bag")));
  SourceOptions options;
  options.recording.imu_yaml = (folder_ / "other.yaml").string();
  EXPECT_THAT(openSource(bag_, options)->statistics().warnings, IsEmpty());
  fs::remove(folder_ / "camchain.yaml");
  EXPECT_THAT(
      dataErrorOf([this] { openSource(bag_); }),
      HasSubstr("expected Kalibr's camchain.yaml beside the bag, or the option --camchain"));
}

TEST_F(Ros1Bag, WrongBytesAreReadOrRefused) {
  convertThere();
  const std::string whole = readText(bag_);
  std::mt19937 random(5);
  int refused = 0;
  constexpr int kBags = 60;
  for (int i = 0; i < kBags; ++i) {
    std::string spoilt = whole;
    const size_t at = random() % spoilt.size();
    for (size_t k = at; k < std::min(at + 4, spoilt.size()); ++k)
      spoilt[k] = static_cast<char>(i % 2 == 0 ? 0xff : random());
    writeText(bag_, spoilt);
    refused += dataErrorOf([this] { readAll(*openSource(bag_)); }).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 3);          // structure, stamps and quaternions are a fifth of the bytes
  EXPECT_LT(refused, kBags / 2);  // the rest is pixels and measurements
}

TEST_F(Ros1Bag, ItsFilesAreTheBagAndTheCalibrations) {
  convertThere();
  const auto names = [](const RecordedSource& source) {
    std::vector<std::string> found;
    for (const RecordingFile& file : source.files())
      found.push_back(fs::path(file.path).filename().string());
    return found;
  };
  const auto source = openRecording(bag_);
  EXPECT_THAT(names(*source), ::testing::ElementsAre("flight.bag", "camchain.yaml", "imu.yaml"));
  EXPECT_EQ(source->framePaths(0).first, "");
  EXPECT_THAT(source->calibrationFile("cam1"), HasSubstr("/camchain.yaml"));
  EXPECT_THAT(source->calibrationFile("imu0"), HasSubstr("/imu.yaml"));
  fs::remove(folder_ / "imu.yaml");
  EXPECT_THAT(names(*openRecording(bag_)), ::testing::ElementsAre("flight.bag", "camchain.yaml"));
}

TEST_F(Ros1Bag, ImagesOfAnotherSizeAreSkipped) {
  convertThere();
  replaceInFile(folder_ / "camchain.yaml", "resolution: [64, 48]", "resolution: [64, 50]");
  const std::string error = dataErrorOf([this] { readAll(*openSource(bag_)); });
  EXPECT_THAT(error, AllOf(HasSubstr("topic /cam0/image_raw"), HasSubstr("64x50"),
                           HasSubstr("none can be read")));
}

TEST_F(Ros1Bag, MovesImagesToTheClockOfTheImu) {
  convertThere();
  replaceInFile(folder_ / "camchain.yaml", "timeshift_cam_imu: 0.0", "timeshift_cam_imu: 0.004");
  const auto source = openSource(bag_);
  EXPECT_EQ(source->imageStamps()[1], frameStamp(1) + 4'000'000);
  EXPECT_THAT(source->statistics().warnings, ::testing::Contains(HasSubstr("are moved by 4 ms")));
}

TEST_F(Ros1Bag, ATruncatedOneIsRefused) {
  convertThere();
  const auto size = fs::file_size(bag_);
  for (const double share : {0.999, 0.7, 0.3, 0.01}) {
    fs::resize_file(bag_, static_cast<std::uintmax_t>(share * static_cast<double>(size)));
    EXPECT_THAT(dataErrorOf([this] { openSource(bag_); }),
                AllOf(HasSubstr(bag_), HasSubstr("expected a ROS 1 bag")))
        << share;
  }
}

/** A bag as drivers write them: two sorts of images, stamps that are not the times of recording. */
TEST_F(Ros1Bag, OfDriversIsRead) {
  convertThere();  // for the calibration
  const ros::Time recorded(1500000000, 0);
  const cv::Mat gray(kHeight, kWidth, CV_8UC1, cv::Scalar(77));
  rosbag::Bag bag;
  bag.open((folder_ / "driver.bag").string(), rosbag::bagmode::Write);
  bag.setCompression(rosbag::compression::LZ4);
  for (const int i : {1, 0, 2, 2}) {  // not in order, and one twice
    sensor_msgs::Image left;
    left.header.stamp.fromNSec(static_cast<std::uint64_t>(frameStamp(i)));
    left.width = kWidth;
    left.height = kHeight;
    left.step = 2 * kWidth;
    left.encoding = "mono16";
    for (int k = 0; k < kWidth * kHeight; ++k) {
      left.data.push_back(200);
      left.data.push_back(static_cast<std::uint8_t>(10 * i));
    }
    bag.write("/left", recorded, left);
    sensor_msgs::CompressedImage right;
    right.header.stamp.fromNSec(static_cast<std::uint64_t>(frameStamp(i) + 2'000'000));
    right.format = "mono8; png compressed";
    ASSERT_TRUE(cv::imencode(".png", gray, right.data));
    bag.write("/right/compressed", recorded, right);
  }
  for (int i = 0; i < 40; ++i) {
    sensor_msgs::Imu imu;
    imu.header.stamp.fromNSec(static_cast<std::uint64_t>(kFirstStamp + 5'000'000LL * (i - 5)));
    imu.angular_velocity.x = 0.1;
    imu.linear_acceleration.z = 9.8;
    bag.write("/imu", recorded, imu);
  }
  bag.write("/chatter", recorded, std_msgs::Header());
  bag.close();

  SourceOptions options;
  options.recording.left_topic = "/left";
  options.recording.right_topic = "/right/compressed";
  options.recording.pair_tolerance_s = 0.003;
  const std::string path = (folder_ / "driver.bag").string();
  const auto source = openSource(path, options);
  EXPECT_EQ(source->imageStamps(),
            (std::vector<TimeNs>{frameStamp(0), frameStamp(1), frameStamp(2)}));
  const auto frames = framesOf(readAll(*source));
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[2].left.at<std::uint8_t>(3, 3), 20);
  EXPECT_EQ(frames[2].right.at<std::uint8_t>(3, 3), 77);
  std::string warnings;
  for (const std::string& warning : source->statistics().warnings) warnings += warning + "\n";
  EXPECT_THAT(warnings, AllOf(HasSubstr("topic /left: messages were not in the order"),
                              HasSubstr("topic /left: 1 messages with the stamp of another"),
                              HasSubstr("right camera are 2 ms after")));
  EXPECT_THAT(dataErrorOf([&] { openSource(path); }),
              AllOf(HasSubstr("expected two topics of images"),
                    HasSubstr("/chatter (std_msgs/Header, 1)")));
}

}  // namespace
}  // namespace etalon::testing
