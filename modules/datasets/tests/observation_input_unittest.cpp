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

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = UnusableObservation::Kind;
using Measurements = std::vector<ObservationInput::Measurement>;

constexpr TimeNs kStep = 50'000'000;

/** An image of one camera, all of one gray level. */
mrpt::obs::CObservationImage imageOf(const std::string& label, TimeNs t, int gray) {
  mrpt::obs::CObservationImage image;
  image.sensorLabel = label;
  image.timestamp = toMrptTime(t);
  image.image = mrpt::img::CImage(cv::Mat(6, 8, CV_8UC1, cv::Scalar(gray)), mrpt::img::DEEP_COPY);
  return image;
}

/** The only measurement, if it is a frame. */
const StereoFrame* frameOf(const Measurements& measurements) {
  if (measurements.size() != 1) return nullptr;
  const auto* event = std::get_if<SensorEvent>(&measurements[0]);
  return event ? std::get_if<StereoFrame>(event) : nullptr;
}

/** The only measurement, which is none. */
UnusableObservation unusable(const Measurements& measurements) {
  EXPECT_EQ(measurements.size(), 1U);
  return std::get<UnusableObservation>(measurements.at(0));
}

Kind kindOf(const Measurements& measurements) { return unusable(measurements).kind; }

/** "pair 3", "left 3", "right 3", "unpaired 3": the stamp in steps. */
std::vector<std::string> words(const Measurements& measurements) {
  std::vector<std::string> all;
  for (const auto& measurement : measurements) {
    const auto* event = std::get_if<SensorEvent>(&measurement);
    const StereoFrame* frame = event ? std::get_if<StereoFrame>(event) : nullptr;
    const TimeNs t = frame ? frame->t : std::get<UnusableObservation>(measurement).t;
    const char* const what = !frame                 ? "unpaired "
                             : frame->left.empty()  ? "right "
                             : frame->right.empty() ? "left "
                                                    : "pair ";
    all.push_back(what + std::to_string(t / kStep));
  }
  return all;
}

int grayOf(const cv::Mat& image) { return image.at<uchar>(3, 3); }

TEST(ObservationInput, TwoImagesOfOneStampAreAPairWhicheverComesFirst) {
  for (const bool left_first : {true, false}) {
    ObservationInput input;
    const auto left = imageOf("cam0", kStep, 10), right = imageOf("cam1", kStep, 20);
    EXPECT_THAT(input.convert(left_first ? left : right), IsEmpty());
    const Measurements pair = input.convert(left_first ? right : left);
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
  EXPECT_THAT(input.convert(image), IsEmpty());
  buffer.setTo(99);
  const Measurements pair = input.convert(imageOf("cam1", kStep, 20));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 10);
}

TEST(ObservationInput, AnImageWhosePartnerNeverComesIsToldWithItsStamp) {
  ObservationInput input;
  const auto give = [&input](const char* camera, int k) {
    return words(input.convert(imageOf(camera, k * kStep, k)));
  };
  EXPECT_THAT(give("cam0", 1), IsEmpty());
  EXPECT_THAT(give("cam0", 2), IsEmpty());
  EXPECT_THAT(give("cam1", 2), ElementsAre("unpaired 1", "pair 2"));
  EXPECT_THAT(give("cam1", 1), ElementsAre("unpaired 1"));  // too late
  // Cameras that never show the same instant.
  std::vector<std::string> all;
  for (int k = 3; k < 40; ++k)
    for (const std::string& word : give(k % 2 == 0 ? "cam0" : "cam1", k)) all.push_back(word);
  ASSERT_EQ(all.size(), 37U - 2U * ObservationInput::kMostWaiting);
  EXPECT_EQ(all.front(), "unpaired 3");
}

TEST(ObservationInput, ACameraMayLagOrComeInBursts) {
  ObservationInput lag, bursts;
  std::vector<std::string> lagging, bursting;
  const auto give = [](ObservationInput* input, const char* camera, int k,
                       std::vector<std::string>* all) {
    for (const std::string& word : words(input->convert(imageOf(camera, k * kStep, k))))
      all->push_back(word);
  };
  for (int k = 1; k <= 20; ++k) {
    give(&lag, "cam0", k, &lagging);
    if (k > 1) give(&lag, "cam1", k - 1, &lagging);
    if (k % 4 != 0) continue;
    for (const char* camera : {"cam1", "cam0"})
      for (int i = k - 3; i <= k; ++i) give(&bursts, camera, i, &bursting);
  }
  ASSERT_EQ(lagging.size(), 19U);
  ASSERT_EQ(bursting.size(), 20U);
  for (int k = 1; k <= 20; ++k) {
    if (k < 20) {
      EXPECT_EQ(lagging[k - 1], "pair " + std::to_string(k));
    }
    EXPECT_EQ(bursting[k - 1], "pair " + std::to_string(k));
  }
}

TEST(ObservationInput, WhereOneCameraIsSilentTheOtherGoesOnAlone) {
  ObservationInput input;
  const auto give = [&input](const char* camera, int k) {
    return words(input.convert(imageOf(camera, k * kStep, k)));
  };
  EXPECT_THAT(give("cam0", 1), IsEmpty());
  for (int k = 2; k <= 6; ++k) EXPECT_THAT(give("cam1", k), IsEmpty());
  EXPECT_THAT(give("cam1", 7),
              ElementsAre("right 2", "right 3", "right 4", "right 5", "right 6", "unpaired 1"));
  const Measurements alone = input.convert(imageOf("cam1", 8 * kStep, 8));
  ASSERT_TRUE(frameOf(alone));
  EXPECT_TRUE(frameOf(alone)->left.empty());
  EXPECT_EQ(grayOf(frameOf(alone)->right), 7);
  // The other one is back.
  const Measurements pair = input.convert(imageOf("cam0", 8 * kStep, 9));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 9);
  EXPECT_THAT(give("cam1", 9), IsEmpty());
  EXPECT_THAT(give("cam1", 10), IsEmpty());
}

TEST(ObservationInput, OneCameraTwiceIsNoPair) {
  ObservationInput input;
  input.convert(imageOf("cam0", kStep, 1));
  EXPECT_EQ(kindOf(input.convert(imageOf("cam0", kStep, 2))), Kind::kUnpaired);
}

TEST(ObservationInput, CamerasAreToldApartByTheirLabels) {
  ObservationInput input("port", "starboard");
  EXPECT_EQ(kindOf(input.convert(imageOf("cam0", kStep, 1))), Kind::kOther);
  EXPECT_THAT(input.convert(imageOf("starboard", kStep, 7)), IsEmpty());
  const Measurements pair = input.convert(imageOf("port", kStep, 9));
  ASSERT_TRUE(frameOf(pair));
  EXPECT_EQ(grayOf(frameOf(pair)->left), 9);
}

TEST(ObservationInput, WhatIsBrokenSaysWhyAndWhatIsForeignDoesNot) {
  ObservationInput input;
  mrpt::obs::CObservationIMU imu;
  imu.timestamp = toMrptTime(kStep);
  imu.set(mrpt::obs::IMU_WX, 0.1);
  const Measurements rates = input.convert(imu);
  EXPECT_EQ(kindOf(rates), Kind::kBroken);
  EXPECT_EQ(unusable(rates).t, kStep);
  EXPECT_THAT(unusable(rates).reason, HasSubstr("three rates"));
  mrpt::obs::CObservationImage empty;
  empty.sensorLabel = "cam1";
  const Measurements image = input.convert(empty);
  EXPECT_EQ(kindOf(image), Kind::kBroken);
  EXPECT_THAT(unusable(image).reason,
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
  EXPECT_THAT(input.convert(imageOf("cam1", kStep, 2)), IsEmpty());
}

TEST(ObservationInput, ExternalImagesWithRelativePathsLieInTheBaseFolder) {
  ObservationInput input("cam0", "cam1", "/no/such/folder");
  auto image = imageOf("cam0", kStep, 1);
  image.image.setExternalStorage("left.png");
  const Measurements missing = input.convert(image);
  EXPECT_EQ(kindOf(missing), Kind::kBroken);
  EXPECT_THAT(unusable(missing).reason, HasSubstr("/no/such/folder/left.png"));
}

TEST(ObservationInput, WithoutABaseFolderExternalImagesLieWhereMrptLooksForThem) {
  const std::string before = mrpt::img::CImage::getImagesPathBase();
  mrpt::img::CImage::setImagesPathBase("/no/such/base");
  auto image = imageOf("cam0", kStep, 1);
  image.image.setExternalStorage("left.png");
  const Measurements missing = ObservationInput().convert(image);
  mrpt::img::CImage::setImagesPathBase(before);
  EXPECT_THAT(unusable(missing).reason, HasSubstr("/no/such/base/left.png"));
}

TEST(ObservationInput, SamplesPassAsTheyAre) {
  ObservationInput input;
  ImuSample sample{1403636584763555500, {0.1, -0.2, 0.3}, {9.7, 0.2, -3.5}};
  const Measurements measurement = input.convert(toObservation(sample));
  const auto& back = std::get<ImuSample>(std::get<SensorEvent>(measurement.at(0)));
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
