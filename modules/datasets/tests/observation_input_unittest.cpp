// MRPT's observations as measurements, one by one, and a pose with its covariance as an observation.

#include "etalon/datasets/observation_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <cmath>
#include <limits>

#include "etalon/core/so3.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/testing/expect_jacobian.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using Kind = UnusableObservation::Kind;
using Measurement = std::variant<SensorEvent, UnusableObservation>;

constexpr TimeNs kStep = 50'000'000;

/** An image of one camera, all of one gray level. */
mrpt::obs::CObservationImage imageOf(const std::string& label, TimeNs t, int gray) {
  mrpt::obs::CObservationImage image;
  image.sensorLabel = label;
  image.timestamp = toMrptTime(t);
  image.image = mrpt::img::CImage(cv::Mat(6, 8, CV_8UC1, cv::Scalar(gray)), mrpt::img::DEEP_COPY);
  return image;
}

const StereoFrame* frameOf(const Measurement& measurement) {
  const auto* event = std::get_if<SensorEvent>(&measurement);
  return event ? std::get_if<StereoFrame>(event) : nullptr;
}

Kind kindOf(const Measurement& measurement) {
  return std::get<UnusableObservation>(measurement).kind;
}

int grayOf(const cv::Mat& image) { return image.at<uchar>(3, 3); }

TEST(ObservationInput, TwoImagesOfOneStampAreAPairWhicheverComesFirst) {
  for (const bool left_first : {true, false}) {
    ObservationInput input;
    const auto left = imageOf("cam0", kStep, 10), right = imageOf("cam1", kStep, 20);
    EXPECT_EQ(kindOf(input.convert(left_first ? left : right)), Kind::kWaiting);
    const Measurement pair = input.convert(left_first ? right : left);
    const StereoFrame* frame = frameOf(pair);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->t, kStep);
    EXPECT_EQ(grayOf(frame->left), 10);
    EXPECT_EQ(grayOf(frame->right), 20);
    EXPECT_EQ(frame->left_path + frame->right_path, "");
  }
}

TEST(ObservationInput, ADriverMayUseItsImageAgainWhileThePartnerIsAwaited) {
  ObservationInput input;
  cv::Mat buffer(6, 8, CV_8UC1, cv::Scalar(10));
  mrpt::obs::CObservationImage image = imageOf("cam0", kStep, 0);
  image.image = mrpt::img::CImage(buffer, mrpt::img::SHALLOW_COPY);
  EXPECT_EQ(kindOf(input.convert(image)), Kind::kWaiting);
  buffer.setTo(99);
  const Measurement pair = input.convert(imageOf("cam1", kStep, 20));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 10);
}

TEST(ObservationInput, AnImageWhosePartnerNeverComesIsToldWithItsStamp) {
  ObservationInput input;
  input.convert(imageOf("cam0", kStep, 1));
  // The same camera again, then the other one of the later stamp.
  const Measurement second = input.convert(imageOf("cam0", 2 * kStep, 2));
  EXPECT_EQ(kindOf(second), Kind::kUnpaired);
  EXPECT_EQ(std::get<UnusableObservation>(second).t, kStep);
  ASSERT_TRUE(frameOf(input.convert(imageOf("cam1", 2 * kStep, 3))));
  // After a pair nothing waits.
  EXPECT_EQ(kindOf(input.convert(imageOf("cam1", 3 * kStep, 4))), Kind::kWaiting);
  const Measurement other = input.convert(imageOf("cam0", 4 * kStep, 5));
  EXPECT_EQ(kindOf(other), Kind::kUnpaired);
  EXPECT_EQ(std::get<UnusableObservation>(other).t, 3 * kStep);
}

TEST(ObservationInput, WhereOneCameraIsSilentTheOtherGoesOnAlone) {
  ObservationInput input;
  input.convert(imageOf("cam1", kStep, 1));
  for (int k = 2; k <= 5; ++k)
    EXPECT_EQ(kindOf(input.convert(imageOf("cam1", k * kStep, k))), Kind::kUnpaired);
  for (int k = 6; k <= 8; ++k) {
    const Measurement alone = input.convert(imageOf("cam1", k * kStep, k));
    ASSERT_TRUE(frameOf(alone));
    EXPECT_EQ(frameOf(alone)->t, (k - 1) * kStep);
    EXPECT_TRUE(frameOf(alone)->left.empty());
    EXPECT_EQ(grayOf(frameOf(alone)->right), k - 1);
  }
  // The other one is back.
  const Measurement pair = input.convert(imageOf("cam0", 8 * kStep, 9));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 9);
  input.convert(imageOf("cam1", 9 * kStep, 1));
  EXPECT_EQ(kindOf(input.convert(imageOf("cam1", 10 * kStep, 1))), Kind::kUnpaired);
}

TEST(ObservationInput, OneCameraTwiceIsNoPair) {
  ObservationInput input;
  input.convert(imageOf("cam0", kStep, 1));
  EXPECT_EQ(kindOf(input.convert(imageOf("cam0", kStep, 2))), Kind::kUnpaired);
}

TEST(ObservationInput, CamerasAreToldApartByTheirLabels) {
  ObservationInput input("port", "starboard");
  EXPECT_EQ(kindOf(input.convert(imageOf("cam0", kStep, 1))), Kind::kOther);
  EXPECT_EQ(kindOf(input.convert(imageOf("starboard", kStep, 7))), Kind::kWaiting);
  const Measurement pair = input.convert(imageOf("port", kStep, 9));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 9);
}

TEST(ObservationInput, WhatIsBrokenSaysWhyAndWhatIsForeignDoesNot) {
  ObservationInput input;
  mrpt::obs::CObservationIMU imu;
  imu.timestamp = toMrptTime(kStep);
  imu.set(mrpt::obs::IMU_WX, 0.1);
  const Measurement rates = input.convert(imu);
  EXPECT_EQ(kindOf(rates), Kind::kBroken);
  EXPECT_EQ(std::get<UnusableObservation>(rates).t, kStep);
  EXPECT_THAT(std::get<UnusableObservation>(rates).reason, HasSubstr("three rates"));
  mrpt::obs::CObservationImage empty;
  empty.sensorLabel = "cam1";
  const Measurement image = input.convert(empty);
  EXPECT_EQ(kindOf(image), Kind::kBroken);
  EXPECT_THAT(std::get<UnusableObservation>(image).reason,
              HasSubstr("image observation 'cam1': expected images, found an empty one"));
  mrpt::obs::CObservationStereoImages one_eyed;
  one_eyed.hasImageRight = false;
  EXPECT_EQ(kindOf(input.convert(one_eyed)), Kind::kBroken);
  EXPECT_EQ(kindOf(input.convert(mrpt::obs::CObservation2DRangeScan())), Kind::kOther);
}

TEST(ObservationInput, ABrokenImageDoesNotWaitForItsPartner) {
  ObservationInput input;
  auto broken = imageOf("cam0", kStep, 1);
  broken.image = mrpt::img::CImage();
  EXPECT_EQ(kindOf(input.convert(broken)), Kind::kBroken);
  EXPECT_EQ(kindOf(input.convert(imageOf("cam1", kStep, 2))), Kind::kWaiting);
}

TEST(ObservationInput, ExternalImagesWithRelativePathsLieInTheBaseFolder) {
  ObservationInput input("cam0", "cam1", "/no/such/folder");
  auto image = imageOf("cam0", kStep, 1);
  image.image.setExternalStorage("left.png");
  const Measurement missing = input.convert(image);
  EXPECT_EQ(kindOf(missing), Kind::kBroken);
  EXPECT_THAT(std::get<UnusableObservation>(missing).reason, HasSubstr("/no/such/folder/left.png"));
}

TEST(ObservationInput, WithoutABaseFolderExternalImagesLieWhereMrptLooksForThem) {
  const std::string before = mrpt::img::CImage::getImagesPathBase();
  mrpt::img::CImage::setImagesPathBase("/no/such/base");
  auto image = imageOf("cam0", kStep, 1);
  image.image.setExternalStorage("left.png");
  const Measurement missing = ObservationInput().convert(image);
  mrpt::img::CImage::setImagesPathBase(before);
  EXPECT_THAT(std::get<UnusableObservation>(missing).reason, HasSubstr("/no/such/base/left.png"));
}

TEST(ObservationInput, SamplesPassAsTheyAre) {
  ObservationInput input;
  ImuSample sample{1403636584763555500, {0.1, -0.2, 0.3}, {9.7, 0.2, -3.5}};
  const Measurement measurement = input.convert(toObservation(sample));
  const auto& back = std::get<ImuSample>(std::get<SensorEvent>(measurement));
  EXPECT_EQ(back.t, sample.t);
  EXPECT_EQ(back.gyro, sample.gyro);
  EXPECT_EQ(back.accel, sample.accel);
}

/** x, y, z, yaw, pitch, roll of a pose, as MRPT has them. */
Eigen::Matrix<double, 6, 1> mrptNumbers(const SE3& T) {
  const mrpt::poses::CPose3D pose = toMrptPose(T);
  Eigen::Matrix<double, 6, 1> numbers;
  numbers << pose.x(), pose.y(), pose.z(), pose.yaw(), pose.pitch(), pose.roll();
  return numbers;
}

TEST(PoseCovariance, BecomesThatOfMrptsSixNumbers) {
  // To first order J P J^T with J the derivative of the six numbers by rotation and position.
  Eigen::Matrix<double, 6, 6> root = Eigen::Matrix<double, 6, 6>::Identity();
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) root(r, c) += 0.1 * std::sin(1.0 + 7.0 * r + c);
  const Eigen::Matrix<double, 6, 6> P = 1e-4 * root * root.transpose();
  for (const Eigen::Vector3d& rotation :
       {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.4, -0.9, 1.3),
        Eigen::Vector3d(-2.0, 0.5, 0.7)}) {
    const SE3 T_WB(expSO3(rotation), {1.0, 2.0, 3.0});
    const Eigen::MatrixXd J = testing::numericalJacobian(mrptNumbers, T_WB, 1e-3);
    const auto observation = toObservation(StampedPose{5, T_WB}, "pose", P);
    const Eigen::Matrix<double, 6, 6> expected = J * P * J.transpose();
    EXPECT_LT((observation.pose.cov.asEigen() - expected).norm(), 1e-8 * expected.norm());
  }
}

TEST(PoseCovariance, IsZeroOfAnExactPoseAndLargeWhereItIsNotKnown) {
  const StampedPose pose{5, SE3()};
  EXPECT_EQ(toObservation(pose, "pose").pose.cov.asEigen().norm(), 0.0);
  Eigen::Matrix<double, 6, 6> P = Eigen::Matrix<double, 6, 6>::Identity();
  P(2, 3) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix<double, 6, 6> unknown = toObservation(pose, "pose", P).pose.cov.asEigen();
  EXPECT_TRUE(unknown.isDiagonal());
  EXPECT_EQ(unknown(0, 0), 1e6);                   // m^2
  EXPECT_NEAR(unknown(5, 5), M_PI * M_PI, 1e-12);  // rad^2
}

}  // namespace
}  // namespace etalon
