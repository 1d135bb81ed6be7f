#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "euroc_source_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(EurocSource, DeliversEventsInTimeOrderWithTheImuFirst) {
  const auto source = open();
  EXPECT_EQ(source->kind(), "euroc");
  const std::vector<SensorEvent> events = readAll(*source);
  for (size_t i = 1; i < events.size(); ++i) {
    ASSERT_LE(stampOf(events[i - 1]), stampOf(events[i]));
    if (stampOf(events[i - 1]) == stampOf(events[i])) {
      EXPECT_TRUE(std::holds_alternative<ImuSample>(events[i - 1]));
    }
  }
  const auto frames = framesOf(events);
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) EXPECT_EQ(frames[i].t, frameStamp(i));
  const cv::Mat expected = cv::imread(leftImage(2).string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(cv::norm(frames[2].left, expected, cv::NORM_INF), 0);
  EXPECT_EQ(frames[2].left_path, leftImage(2).string());
  // From 50 ms before the first image to 50 ms after the last one.
  const auto imu = imuOf(events);
  EXPECT_EQ(imu.front().t, kFirstStamp - 45'000'000 + -9 % 7);
  EXPECT_EQ(imu.back().t, kFirstStamp + 300'000'000 + 60 % 7);
  EXPECT_TRUE(imu.back().gyro.isApprox(Eigen::Vector3d(0.6, 0.04, 0.3), 1e-15));
  EXPECT_EQ(source->statistics().stereo_frames, kFrames);
  EXPECT_EQ(source->statistics().imu_samples, static_cast<int>(imu.size()));
  EXPECT_TRUE(source->statistics().warnings.empty());
}

TEST_F(EurocSource, AnImuThatIsSlowerThanItsCalibrationSaysHasTheRateOfItsStamps) {
  replaceInFile(mav0("imu0/sensor.yaml"), "rate_hz: 200\n", "rate_hz: 1000\n");
  const auto source = open();
  EXPECT_NEAR(source->calibration().imu.rate_hz, 200, 1e-3);
  EXPECT_THAT(source->statistics().warnings,
              ElementsAre(AllOf(HasSubstr("the IMU has 1000 Hz"), HasSubstr("200 Hz, which"))));
}

TEST_F(EurocSource, AnImuStampedInBatchesIsTold) {
  std::string rows = "#timestamp [ns],w,w,w,a,a,a\n";
  for (int k = 0; k < 100; ++k)  // five every 25 ms
    rows += std::to_string(kFirstStamp + k / 5 * 25'000'000 + k % 5 * 100'000) +
            ",0.1,0.2,0.3,0,0,9.8\n";
  writeText(mav0("imu0/data.csv"), rows);
  replaceInFile(mav0("imu0/sensor.yaml"), "rate_hz: 200\n", "");
  const auto source = open();
  EXPECT_NEAR(source->calibration().imu.rate_hz, 200, 15);
  EXPECT_THAT(source->statistics().warnings,
              ::testing::Contains(HasSubstr("IMU samples come in batches, one every 4.8")));
}

TEST_F(EurocSource, OpensMav0Itself) {
  EXPECT_EQ(openRecording(mav0("").string())->imageStamps().size(), kFrames);
}

TEST_F(EurocSource, ReadsCalibrationAndGroundTruth) {
  const auto source = open();
  const CameraCalibration& camera = source->calibration().cameras[1];
  EXPECT_EQ(camera.model.parameter("fv"), 45.25);
  EXPECT_EQ(camera.model.parameter("p2"), 1.7e-5);
  EXPECT_EQ(camera.T_BC.t, Eigen::Vector3d(-0.02, 0.06, 0.01));
  EXPECT_EQ(camera.rate_hz, 20);
  EXPECT_EQ(source->calibration().imu.noise.accel_random_walk, 3e-3);
  const GroundTruth& truth = source->groundTruth();
  ASSERT_EQ(truth.states.size(), 36u);
  EXPECT_TRUE(truth.has_velocity && truth.has_biases);
  EXPECT_EQ(truth.states[0].T_WB.t, Eigen::Vector3d(-0.5, 1.5, 1.5));
  EXPECT_EQ(truth.states[0].v_WB, Eigen::Vector3d(-0.05, 0.5, -0.25));
  EXPECT_EQ(truth.states[0].bias.accel, Eigen::Vector3d(0.1, 0.2, 0.3 - 5e-5));
}

TEST_F(EurocSource, QuaternionOfGroundTruthIsInTheOrderWXYZ) {
  // A quarter turn about z: x_B points along y_W.
  replaceLine(
      mav0("state_groundtruth_estimate0/data.csv"), 2,
      "1403636584000000000,0,0,0,0.70710678118654757,0,0,0.70710678118654757,0,0,0,0,0,0,0,0,0");
  const Eigen::Matrix3d R = open()->groundTruth().states[0].T_WB.R;
  EXPECT_LT((R.col(0) - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST_F(EurocSource, TheBodyFrameIsTheImu) {
  // The IMU turned by 180 deg about z against the rig.
  replaceInFile(mav0("imu0/sensor.yaml"), "[1.0, 0.0, 0.0, 0.0, 0.0, 1.0,",
                "[-1.0, 0.0, 0.0, 0.0, 0.0, -1.0,");
  const auto source = open();
  EXPECT_LT((source->calibration().cameras[1].T_BC.t - Eigen::Vector3d(0.02, -0.06, 0.01)).norm(),
            1e-12);
  const StampedState& state = source->groundTruth().states[0];
  EXPECT_TRUE(source->groundTruth().has_velocity);
  EXPECT_LT((state.bias.accel - Eigen::Vector3d(-0.1, -0.2, 0.3 - 5e-5)).norm(), 1e-12);
}

TEST_F(EurocSource, ALeverArmTakesTheVelocityFromGroundTruth) {
  replaceInFile(mav0("imu0/sensor.yaml"), "[1.0, 0.0, 0.0, 0.0,", "[1.0, 0.0, 0.0, 0.1,");
  const auto source = open();
  EXPECT_FALSE(source->groundTruth().has_velocity);
  EXPECT_TRUE(source->groundTruth().has_biases);
  const StampedState& state = source->groundTruth().states[0];
  const Eigen::Vector3d p_rig(-0.5, 1.5, 1.5);
  EXPECT_LT((state.T_WB.t - p_rig - 0.1 * state.T_WB.R.col(0)).norm(), 1e-12);
}

TEST_F(EurocSource, AcceptsOpenCvsYaml) {
  const fs::path yaml = mav0("cam0/sensor.yaml");
  replaceInFile(yaml, "T_BS:\n", "T_BS: !!opencv-matrix\n");
  writeText(yaml, "%YAML:1.0\n---\n" + readText(yaml));
  EXPECT_EQ(open()->calibration().cameras[0].model.parameter("fu"), 45.5);
  replaceInFile(yaml, "camera_model: pinhole", "camera_model: omni");
  // The line of the file as it is, the directive included: 2 lines before, 14th line of the rest.
  EXPECT_THAT(openingError(), AllOf(HasSubstr("cam0/sensor.yaml:15: "), HasSubstr("'omni'"),
                                    HasSubstr("supported is 'pinhole'")));
}

TEST_F(EurocSource, AByteOrderMarkIsNoPartOfAFile) {
  for (const char* file : {"cam0/data.csv", "cam1/sensor.yaml", "imu0/data.csv",
                           "state_groundtruth_estimate0/data.csv"})
    writeText(mav0(file), "\xEF\xBB\xBF" + readText(mav0(file)));
  EXPECT_FALSE(open()->groundTruth().empty());
}

TEST_F(EurocSource, WorksWithoutRatesAndGroundTruth) {
  for (const char* sensor : {"cam0", "cam1"})
    replaceInFile(mav0(std::string(sensor) + "/sensor.yaml"), "rate_hz: 20\n", "");
  replaceInFile(mav0("imu0/sensor.yaml"), "rate_hz: 200\n", "");
  fs::remove_all(mav0("state_groundtruth_estimate0"));
  const auto source = open();
  EXPECT_TRUE(source->groundTruth().empty());
  EXPECT_NEAR(source->calibration().cameras[0].rate_hz, 20, 1e-4);  // stamps jitter by 7 ns
  EXPECT_NEAR(source->calibration().imu.rate_hz, 200, 1e-3);
}

TEST_F(EurocSource, ReadsPoseOnlyGroundTruthCarriageReturnsAndComments) {
  writeText(mav0("state_groundtruth_estimate0/data.csv"),
            "# stamp, p, q\r\n1403636584763555584, 1, 2, 3, 1, 0, 0, 0\r\n\r\n# more\r\n"
            "1403636584773555584,1,2,+3.5,1,0,0,0\r\n");
  std::string csv = readText(mav0("cam1/data.csv"));
  for (size_t at = 0; (at = csv.find('\n', at)) != std::string::npos; at += 2) csv.insert(at, "\r");
  writeText(mav0("cam1/data.csv"), csv);
  const auto source = open();
  ASSERT_EQ(source->groundTruth().states.size(), 2u);
  EXPECT_FALSE(source->groundTruth().has_velocity);
  EXPECT_FALSE(source->groundTruth().has_biases);
  EXPECT_EQ(source->groundTruth().states[1].T_WB.t.z(), 3.5);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames));
}

TEST_F(EurocSource, CountsAndReportsUnpairedImages) {
  replaceLine(mav0("cam1/data.csv"), 4, "");
  replaceLine(mav0("cam0/data.csv"), 6, "");
  const auto source = open();
  EXPECT_EQ(source->statistics().unpaired_left, 1);
  EXPECT_EQ(source->statistics().unpaired_right, 1);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames - 2));
  ASSERT_EQ(source->statistics().warnings.size(), 2u);
  EXPECT_THAT(source->statistics().warnings[0],
              AllOf(HasSubstr("cam0/data.csv:4: 1 image has no counterpart"),
                    HasSubstr(std::to_string(frameStamp(2)))));
}

TEST_F(EurocSource, NeverOpensImagesOutsideTheRange) {
  for (const int i : {0, 1, 4, 5}) fs::remove(leftImage(i));
  SourceOptions options;
  options.from_s = 0.1;
  options.to_s = 0.1501;
  const auto source = open(options);
  const auto events = readAll(*source);
  const auto frames = framesOf(events);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].t, frameStamp(2));
  EXPECT_EQ(source->statistics().unreadable_images, 0);
  const auto imu = imuOf(events);
  EXPECT_GE(imu.front().t, frameStamp(2) - 50'000'000);
  EXPECT_LT(imu.front().t, frameStamp(2) - 44'000'000);
  EXPECT_GE(imu.back().t, frameStamp(3));
  EXPECT_LT(imu.back().t, frameStamp(3) + 6'000'000);
  EXPECT_EQ(source->imageStamps().size(), static_cast<size_t>(kFrames));
}

TEST_F(EurocSource, TheImuReachesToTheLastImageOfARange) {
  SourceOptions options;
  options.to_s = secondsBetween(kFirstStamp, frameStamp(3));  // its IMU sample is stamped later
  replaceInFile(mav0("imu0/data.csv"), std::to_string(kFirstStamp + 150'000'000 + 30 % 7),
                std::to_string(kFirstStamp + 150'000'100));
  const auto events = readAll(*open(options));
  EXPECT_EQ(framesOf(events).back().t, frameStamp(3));
  EXPECT_EQ(imuOf(events).back().t, kFirstStamp + 150'000'100);
}

TEST_F(EurocSource, TheImuEndsSoonAfterTheLastImage) {
  std::string samples = readText(mav0("imu0/data.csv"));
  const std::string values = samples.substr(samples.rfind(',', samples.rfind(',') - 1));
  for (const int seconds : {10, 20})
    samples +=
        std::to_string(frameStamp(kFrames - 1) + seconds * 1'000'000'000LL) + ",0,0,0,9.8" + values;
  writeText(mav0("imu0/data.csv"), samples);
  EXPECT_LE(imuOf(readAll(*open())).back().t, frameStamp(kFrames - 1) + 50'000'000);
  SourceOptions all;
  all.imu_margin_s = 1e18;
  EXPECT_EQ(imuOf(readAll(*open(all))).back().t, frameStamp(kFrames - 1) + 20'000'000'000LL);
}

TEST_F(EurocSource, ARangeWithoutImagesIsAnError) {
  SourceOptions options;
  options.from_s = 7;
  EXPECT_THAT(dataErrorOf([&] { open(options); }), HasSubstr("no image lies in the range from 7"));
}

TEST_F(EurocSource, DeliversPathsAloneWithoutDecoding) {
  SourceOptions options;
  options.decode_images = false;
  fs::remove_all(mav0("cam0/data"));
  const auto frames = framesOf(readAll(*open(options)));
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  EXPECT_TRUE(frames[0].left.empty());
  EXPECT_EQ(frames[0].left_path, leftImage(0).string());
}

TEST_F(EurocSource, SkipsAndReportsUnreadableImages) {
  writeText(leftImage(1), "this is no PNG");
  cv::imwrite(leftImage(2).string(), cv::Mat(kHeight, kWidth - 1, CV_8UC1, cv::Scalar(9)));
  fs::remove(leftImage(3));
  const std::string png = readText(leftImage(4));
  writeText(leftImage(4), png.substr(0, png.size() / 2));
  const auto source = open();
  const auto frames = framesOf(readAll(*source));
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[1].t, frameStamp(5));
  EXPECT_EQ(source->statistics().unreadable_images, 4);
  ASSERT_EQ(source->statistics().warnings.size(), 4u);
  const auto& warnings = source->statistics().warnings;
  EXPECT_THAT(warnings[0], AllOf(HasSubstr(leftImage(1).string()), HasSubstr("expected a PNG")));
  EXPECT_THAT(warnings[1], AllOf(HasSubstr("64x48"), HasSubstr("found 63x48")));
  EXPECT_THAT(warnings[2], HasSubstr("no such image"));
  EXPECT_THAT(warnings[3], HasSubstr("truncated"));
}

TEST_F(EurocSource, HeadersShowUnusableImagesWithoutDecoding) {
  writeText(leftImage(1), "this is no PNG");
  cv::imwrite(leftImage(2).string(), cv::Mat(kHeight, kWidth - 1, CV_8UC1, cv::Scalar(9)));
  fs::remove(leftImage(3));
  const std::string png = readText(leftImage(4));
  writeText(leftImage(4), png.substr(0, png.size() / 2));
  writeText(leftImage(5), png.substr(0, 20));
  SourceOptions options;
  options.decode_images = false;
  options.check_images = true;
  const auto source = open(options);
  const auto frames = framesOf(readAll(*source));
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_TRUE(frames[0].left.empty());
  EXPECT_EQ(frames[0].left_path, leftImage(0).string());
  EXPECT_EQ(source->statistics().unreadable_images, 5);
  const auto& warnings = source->statistics().warnings;
  ASSERT_EQ(warnings.size(), 5u);
  EXPECT_THAT(warnings[0], AllOf(HasSubstr(leftImage(1).string()), HasSubstr("expected a PNG")));
  EXPECT_THAT(warnings[1], AllOf(HasSubstr("64x48"), HasSubstr("found 63x48")));
  EXPECT_THAT(warnings[2], HasSubstr("no such image"));
  EXPECT_THAT(warnings[3], HasSubstr("truncated"));
  EXPECT_THAT(warnings[4], HasSubstr("truncated"));
  fs::remove(leftImage(0));
  EXPECT_THAT(dataErrorOf([&] { readAll(*open(options)); }), HasSubstr("none can be read"));
}

TEST_F(EurocSource, CountsTheImagesOutsideTheImusTime) {
  const auto file = mav0("imu0/data.csv");
  std::string text = readText(file);
  // The sample of the fourth image, 150 ms after the first, is the last.
  const std::string last = "\n" + std::to_string(kFirstStamp + 150'000'000LL + 30 % 7) + ",";
  const size_t at = text.find(last);
  ASSERT_NE(at, std::string::npos);
  writeText(file, text.substr(0, text.find('\n', at + 1) + 1));
  const auto source = open();
  EXPECT_EQ(source->statistics().outside_imu, 3);  // the fourth one's stamp is 19 ns later
  EXPECT_THAT(source->statistics().warnings,
              ::testing::ElementsAre(AllOf(HasSubstr("3 of 6 stereo frames lie outside the IMU"),
                                           HasSubstr("0.15 s after the first image"))));
  SourceOptions options;
  options.to_s = 0.12;
  EXPECT_EQ(open(options)->statistics().outside_imu, 0);
}

TEST_F(EurocSource, AnUnreadableFirstImageIsSkippedAsAnyOther) {
  writeText(leftImage(0), "");
  const auto source = open();
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames - 1));
  EXPECT_EQ(source->statistics().unreadable_images, 1);
  EXPECT_THAT(source->statistics().warnings,
              ElementsAre(AllOf(HasSubstr(leftImage(0).string()), HasSubstr("empty"))));
}

TEST_F(EurocSource, NoReadableImageIsAnError) {
  for (int i = 0; i < kFrames; ++i) writeText(leftImage(i), "");
  const auto source = open();
  EXPECT_THAT(dataErrorOf([&] { readAll(*source); }),
              AllOf(HasSubstr(leftImage(0).string()), HasSubstr("empty"),
                    HasSubstr("of 6 stereo pairs none can be read")));
}

TEST_F(EurocSource, OpenSourceSaysWhatItExpected) {
  EXPECT_EQ(openSource(folder.path())->kind(), "euroc");
  EXPECT_THAT(dataErrorOf([] { openSource("/no/such/thing"); }),
              AllOf(HasSubstr("/no/such/thing"), HasSubstr(".rawlog")));
}

TEST_F(EurocSource, RepairsRoundedRotations) {
  replaceInFile(mav0("cam0/sensor.yaml"), "[0.0, -1.0,", "[0.0005, -1.0,");
  const auto source = open();
  const Eigen::Matrix3d& R = source->calibration().cameras[0].T_BC.R;
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  ASSERT_EQ(source->statistics().warnings.size(), 1u);
  EXPECT_THAT(source->statistics().warnings[0],
              AllOf(HasSubstr("cam0/sensor.yaml:7"), HasSubstr("nearest rotation")));
}

}  // namespace
}  // namespace etalon::testing
