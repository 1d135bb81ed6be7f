#include "etalon/datasets/observation_conversion.h"

#include <gtest/gtest.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_streams.h>

#include <opencv2/core.hpp>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/datasets/mrpt_time.h"

namespace etalon {
namespace {

StereoInertialCalibration exampleCalibration() {
  StereoInertialCalibration calibration;
  for (size_t c = 0; c < 2; ++c) {
    calibration.cameras[c].model =
        CameraModel("pinhole", "radial-tangential", 40, 30,
                    {30.5, 30.25, 19.5, 14.5 + static_cast<double>(c)}, {-0.28, 0.07, 1e-4, -2e-5});
    calibration.cameras[c].T_BC = {expSO3({0.1, -1.5, 0.3 + 0.01 * static_cast<double>(c)}),
                                   {0.11 * static_cast<double>(c), 0.02, -0.03}};
  }
  return calibration;
}

TEST(MrptTime, LosesNothingButTheTick) {
  for (const TimeNs t : {TimeNs{0}, TimeNs{99}, TimeNs{100}, TimeNs{1403636584763555584},
                         TimeNs{4102444800999999999}})
    EXPECT_EQ(fromMrptTime(toMrptTime(t)), truncateToMrptTick(t));
  // The same instant for MRPT: doubles of seconds resolve 2.4e-7 s at this time.
  EXPECT_NEAR(mrpt::Clock::toDouble(toMrptTime(1403636584763555584)), 1403636584.763555584, 5e-7);
}

TEST(ObservationConversion, ImuSampleIsExact) {
  const ImuSample sample{1403636584763555500, {0.1, -0.2, 1.0 / 3}, {9.7, 1e-17, -3.5}};
  const auto back = toImuSample(toObservation(sample));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->t, sample.t);
  EXPECT_EQ(back->gyro, sample.gyro);
  EXPECT_EQ(back->accel, sample.accel);
}

TEST(ObservationConversion, AnImuWithoutRatesGivesNoSample) {
  mrpt::obs::CObservationIMU orientation;
  orientation.set(mrpt::obs::IMU_YAW, 1.0);
  orientation.set(mrpt::obs::IMU_X_ACC, 1.0);
  EXPECT_FALSE(toImuSample(orientation).has_value());
}

TEST(ObservationConversion, CalibrationSurvivesTheObservation) {
  const StereoInertialCalibration calibration = exampleCalibration();
  const SE3 T_RB(expSO3({0.5, 0.1, -0.2}), {1, 2, 3});
  auto observation = toObservation(StereoFrame{}, calibration);
  // A robot frame R beside the IMU: the sensor's poses are those on the robot.
  observation.setSensorPose(toMrptPose(T_RB * calibration.cameras[0].T_BC));
  const StereoInertialCalibration back = calibrationOf(observation, T_RB, "test");
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_TRUE(
        back.cameras[c].T_BC.matrix().isApprox(calibration.cameras[c].T_BC.matrix(), 1e-12));
    EXPECT_TRUE(back.cameras[c].model == calibration.cameras[c].model);
  }
}

TEST(ObservationConversion, ImagesSurviveSerialization) {
  cv::Mat wide(30, 80, CV_8UC1);
  cv::RNG(3).fill(wide, cv::RNG::UNIFORM, 0, 256);
  StereoFrame frame;
  frame.t = 1403636584763555500;
  frame.left = wide.colRange(0, 40);  // not contiguous: MRPT alone would write what cannot be read
  frame.right = wide.colRange(40, 80).clone();
  std::stringstream stream;
  {
    mrpt::serialization::CArchiveStreamBase<std::ostream> out(stream);
    out << toObservation(frame, exampleCalibration());
  }
  mrpt::serialization::CArchiveStreamBase<std::istream> in(stream);
  const auto object = in.ReadObject<mrpt::obs::CObservationStereoImages>();
  const StereoFrame back = toStereoFrame(*object);
  EXPECT_EQ(back.t, frame.t);
  EXPECT_EQ(cv::norm(back.left, frame.left, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(back.right, frame.right, cv::NORM_INF), 0);
  EXPECT_TRUE(back.left_path.empty());
}

TEST(ObservationConversion, ColourImagesBecomeGray) {
  auto observation = toObservation(StereoFrame{}, exampleCalibration());
  observation.imageLeft =
      mrpt::img::CImage(cv::Mat(30, 40, CV_8UC3, cv::Scalar(70, 70, 70)), mrpt::img::DEEP_COPY);
  observation.imageRight = observation.imageLeft;
  const StereoFrame frame = toStereoFrame(observation);
  EXPECT_EQ(frame.left.type(), CV_8UC1);
  EXPECT_EQ(cv::norm(frame.left, cv::Mat(30, 40, CV_8UC1, cv::Scalar(70)), cv::NORM_INF), 0);
}

TEST(ObservationConversion, MissingImagesAreErrors) {
  auto observation = toObservation(StereoFrame{}, exampleCalibration());
  EXPECT_THROW(toStereoFrame(observation), DataError);
  observation.hasImageRight = false;
  EXPECT_THROW(toStereoFrame(observation), DataError);
  StereoFrame frame;
  frame.left_path = frame.right_path = "not/there.png";
  EXPECT_THROW(toStereoFrame(toObservation(frame, exampleCalibration(), true), "/tmp"), DataError);
}

TEST(ObservationConversion, PosesSurvive) {
  const SE3 T_WB(expSO3({2.0, -1.0, 0.5}), {1.25, -7.0, 0.1});
  const auto observation = toObservation(StampedPose{1000, T_WB}, "eta");
  EXPECT_EQ(observation.sensorLabel, "eta");
  EXPECT_TRUE(fromMrptPose(observation.pose.mean).matrix().isApprox(T_WB.matrix(), 1e-14));
}

}  // namespace
}  // namespace etalon
