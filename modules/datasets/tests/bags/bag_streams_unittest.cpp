#include "bags/bag_streams.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const BagTopic kRight{"/cam1/image_raw", kImageType, 6}, kLeft{"/cam0/image_raw", kImageType, 6},
    kThird{"/cam2/image_raw", kImageType, 6}, kImu{"/imu0", kImuType, 60},
    kOtherImu{"/imu1", kImuType, 60}, kTruth{"/ground_truth", kPoseType, 9},
    kGoal{"/goal", kPoseType, 1}, kSmallLeft{"/l/compressed", kCompressedImageType, 6},
    kSmallRight{"/r/compressed", kCompressedImageType, 6};

std::string errorOf(const std::vector<BagTopic>& topics, const RecordingOptions& options = {}) {
  return dataErrorOf([&] { chooseStreams(topics, options, {}, "flight.bag"); });
}

TEST(BagStreams, TheOnlyOnesAreTaken) {
  const BagStreams streams = chooseStreams({kRight, kLeft, kImu, kTruth, kGoal}, {}, {}, "bag");
  EXPECT_EQ(streams.left, "/cam1/image_raw");  // the first of the list, which a bag gives by name
  EXPECT_EQ(streams.right, "/cam0/image_raw");
  EXPECT_EQ(streams.imu, "/imu0");
  EXPECT_EQ(streams.truth, "/ground_truth");
  EXPECT_EQ(chooseStreams({kLeft, kRight, kImu, kGoal}, {}, {}, "bag").truth, "");
}

TEST(BagStreams, RawImagesComeBeforeCompressedOnes) {
  EXPECT_EQ(chooseStreams({kLeft, kRight, kSmallLeft, kSmallRight, kImu}, {}, {}, "bag").left,
            "/cam0/image_raw");
  EXPECT_EQ(chooseStreams({kSmallLeft, kSmallRight, kImu}, {}, {}, "bag").right, "/r/compressed");
}

TEST(BagStreams, OptionsComeFirstThenKalibrsFiles) {
  RecordingOptions options;
  options.right_topic = "/cam2/image_raw";
  options.imu_topic = "/imu1";
  const KalibrTopics kalibr{"/cam1/image_raw", "/cam0/image_raw", "/imu0"};
  const std::vector<BagTopic> topics = {kLeft, kRight, kThird, kImu, kOtherImu};
  const BagStreams streams = chooseStreams(topics, options, kalibr, "bag");
  EXPECT_EQ(streams.left, "/cam1/image_raw");
  EXPECT_EQ(streams.right, "/cam2/image_raw");
  EXPECT_EQ(streams.imu, "/imu1");
  // Topics of Kalibr's that the bag does not have say nothing.
  EXPECT_EQ(chooseStreams({kLeft, kRight, kImu}, {}, {"/a", "/b", "/c"}, "bag").imu, "/imu0");
}

TEST(BagStreams, OneCameraThatIsGivenLeavesTheOther) {
  RecordingOptions options;
  options.left_topic = "/cam1/image_raw";
  EXPECT_EQ(chooseStreams({kLeft, kRight, kImu}, options, {}, "bag").right, "/cam0/image_raw");
}

TEST(BagStreams, ErrorsListTheTopics) {
  EXPECT_THAT(errorOf({kLeft, kRight, kThird, kImu}),
              AllOf(HasSubstr("flight.bag: expected two topics of images, or --left-topic"),
                    HasSubstr("/cam0/image_raw (sensor_msgs/Image, 6), /cam1")));
  EXPECT_THAT(errorOf({kLeft, kImu}), HasSubstr("expected two topics of images"));
  EXPECT_THAT(errorOf({kLeft, kRight}), HasSubstr("expected one topic of the IMU, --imu-topic"));
  EXPECT_THAT(errorOf({kLeft, kRight, kImu, kOtherImu}),
              HasSubstr("expected one topic of the IMU"));
  EXPECT_THAT(errorOf({}), HasSubstr("topics: none"));
  RecordingOptions options;
  options.imu_topic = "/imu";
  EXPECT_THAT(errorOf({kLeft, kRight, kImu}, options),
              AllOf(HasSubstr("no samples of the IMU (sensor_msgs/Imu) on the topic '/imu'"),
                    HasSubstr("did you mean '/imu0'?")));
  options.imu_topic = "/cam0/image_raw";
  EXPECT_THAT(errorOf({kLeft, kRight, kImu}, options), HasSubstr("no samples of the IMU"));
  options = {};
  options.left_topic = options.right_topic = "/cam0/image_raw";
  EXPECT_THAT(errorOf({kLeft, kRight, kImu}, options), HasSubstr("'/cam0/image_raw' twice"));
}

}  // namespace
}  // namespace etalon::testing
