#include "etalon/frontend/time_offset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Eigen::Matrix3d kR_CB = expSO3({0.4, -1.2, 0.7});

/** Rates of a motion that does not repeat itself: incommensurable sines about all three axes. */
Eigen::Vector3d exampleRate(double t) {
  return {0.5 * std::sin(2.1 * t) + 0.3 * std::sin(5.3 * t), 0.4 * std::cos(3.7 * t),
          0.3 * std::sin(1.3 * t + 1.0) + 0.2 * std::cos(4.1 * t)};
}

/** Gyro samples in units of `scale` rad/s; the camera's clock is `offset_s` behind the gyro's. */
std::vector<ImuSample> exampleImu(double scale) {
  std::vector<ImuSample> imu;
  for (int i = -400; i < 2000; ++i)
    imu.push_back({5'000'000LL * i,
                   scale * (exampleRate(5e-3 * i) + Eigen::Vector3d(-0.01, 0.02, 0.08)),
                   Eigen::Vector3d(0, 0, 9.81)});
  return imu;
}

std::vector<RotationStep> exampleSteps(double offset_s, double noise_rad, int count = 120) {
  std::mt19937 generator(5);
  std::normal_distribution<double> noise;
  std::vector<RotationStep> steps;
  for (int i = 0; i < count; ++i) {
    const double middle_s = 0.05 * i + 0.025 + offset_s;
    Eigen::Vector3d rotation = kR_CB * (0.05 * exampleRate(middle_s));
    for (int k = 0; k < 3; ++k) rotation[k] += noise_rad * noise(generator);
    steps.push_back({50'000'000LL * i, 50'000'000LL * (i + 1), rotation});
  }
  return steps;
}

TEST(TimeOffset, IsFoundWithScaleAndRotation) {
  for (const double offset_s : {0.0, 0.08, -0.113}) {
    const auto estimate =
        estimateTimeOffset(exampleSteps(offset_s, 1e-3), exampleImu(1.0), 0.5, kR_CB);
    ASSERT_TRUE(estimate.clear) << estimate.reason;
    // The noise of 120 steps leaves about 1 ms.
    EXPECT_NEAR(estimate.offset_s, offset_s, 3e-3);
    EXPECT_GT(estimate.correlation, 0.97);
    EXPECT_NEAR(estimate.gyro_scale, 1.0, 0.03);
    ASSERT_TRUE(estimate.R_CB.has_value());
    EXPECT_LT(logSO3(*estimate.R_CB * kR_CB.transpose()).norm(), 0.02);
  }
}

TEST(TimeOffset, DoesNotDependOnTheGyrosUnit) {
  const auto estimate =
      estimateTimeOffset(exampleSteps(0.02, 1e-3), exampleImu(kDegreesPerRadian), 0.5, kR_CB);
  ASSERT_TRUE(estimate.clear);
  EXPECT_NEAR(estimate.offset_s, 0.02, 3e-3);
  EXPECT_NEAR(estimate.gyro_scale, 57.3, 1.5);
}

TEST(TimeOffset, ItsStandardDeviationIsThatOfTheErrors) {
  // Over many draws of noise the offsets scatter as much as each estimate says.
  const std::vector<ImuSample> imu = exampleImu(1.0);
  const std::vector<RotationStep> exact = exampleSteps(0.0, 0.0);
  double squares = 0, sigmas = 0;
  constexpr int kDraws = 60;
  std::mt19937 generator(8);
  std::normal_distribution<double> noise(0, 4e-3);
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<RotationStep> steps = exact;
    for (RotationStep& step : steps)
      for (int k = 0; k < 3; ++k) step.rotation[k] += noise(generator);
    const auto estimate = estimateTimeOffset(steps, imu, 0.2, kR_CB);
    ASSERT_TRUE(estimate.clear) << estimate.reason;
    squares += estimate.offset_s * estimate.offset_s;
    sigmas += estimate.sigma_s;
  }
  const double ratio = std::sqrt(squares / kDraws) / (sigmas / kDraws);
  EXPECT_GT(ratio, 0.7);  // 60 draws leave 9 %
  EXPECT_LT(ratio, 1.4);
}

TEST(TimeOffset, IsDiscernibleOnlyIfItExplainsMoreThanNone) {
  EXPECT_TRUE(
      estimateTimeOffset(exampleSteps(0.06, 1e-3), exampleImu(1.0), 0.5, kR_CB).discernible());
  const auto none = estimateTimeOffset(exampleSteps(0.0, 3e-3), exampleImu(1.0), 0.5, kR_CB);
  EXPECT_TRUE(none.clear);
  EXPECT_FALSE(none.discernible()) << none.offset_s;
}

TEST(TimeOffset, IsDiscernibleByItsGainAndItsStandardDeviationTogether) {
  TimeOffsetEstimate estimate;
  estimate.clear = true;
  estimate.offset_s = -0.02;
  estimate.sigma_s = 1e-3;
  estimate.correlation = 0.95;
  estimate.correlation_at_zero = 0.944;
  EXPECT_TRUE(estimate.discernible());
  estimate.correlation_at_zero = 0.946;  // hardly better than none
  EXPECT_FALSE(estimate.discernible());
  estimate.correlation_at_zero = 0.8;
  estimate.sigma_s = 7e-3;  // 2.9 of them
  EXPECT_FALSE(estimate.discernible());
  estimate.sigma_s = 1e-3;
  estimate.clear = false;
  EXPECT_FALSE(estimate.discernible());
}

TEST(TimeOffset, SeesThatAnAxisIsInverted) {
  std::vector<ImuSample> imu = exampleImu(1.0);
  const auto sound = estimateTimeOffset(exampleSteps(0.0, 1e-3), imu, 0.3, kR_CB);
  EXPECT_LT(sound.correlation_mirrored, sound.correlation - 0.1);
  for (ImuSample& sample : imu) sample.gyro.x() = -sample.gyro.x();
  EXPECT_NEAR(sound.correlation_as_given, sound.correlation, 1e-3);
  const auto mirrored = estimateTimeOffset(exampleSteps(0.0, 1e-3), imu, 0.3, kR_CB);
  EXPECT_GT(mirrored.correlation_mirrored, 0.95);
  EXPECT_LT(mirrored.correlation, 0.9);
}

/** What checkMotion() warns of where the left camera is turned in the body as given. */
std::vector<std::string> warningsOf(const std::vector<ImuSample>& imu,
                                    const Eigen::Matrix3d& given_R_CB) {
  StereoInertialCalibration calibration;
  calibration.cameras[0].T_BC.R = given_R_CB.transpose();
  const auto estimate = estimateTimeOffset(exampleSteps(0.0, 2e-3), imu, 0.3, given_R_CB);
  return checkMotion(estimate, calibration, 20.0).warnings;
}

TEST(CheckMotion, TellsAWrongRotationOfTheCameraFromAWrongSignOfTheGyro) {
  std::vector<ImuSample> imu = exampleImu(1.0);
  EXPECT_THAT(warningsOf(imu, kR_CB), IsEmpty());
  EXPECT_THAT(warningsOf(imu, expSO3({0.02, 0.0, -0.02}) * kR_CB), IsEmpty());
  EXPECT_THAT(warningsOf(imu, expSO3({0.0, radians(30.0), 0.0}) * kR_CB),
              ElementsAre(AllOf(HasSubstr("differs by 30 deg"), HasSubstr("T_BS"))));
  EXPECT_THAT(warningsOf(imu, kR_CB.transpose()), ElementsAre(HasSubstr("T_BS")));
  std::vector<ImuSample> inverted = imu;
  for (ImuSample& sample : inverted) sample.gyro = -sample.gyro;
  EXPECT_THAT(warningsOf(inverted, kR_CB), ElementsAre(HasSubstr("is a sign wrong?")));
  for (ImuSample& sample : imu) sample.gyro.y() = -sample.gyro.y();
  EXPECT_THAT(warningsOf(imu, kR_CB), ElementsAre(HasSubstr("is a sign wrong?")));
}

TEST(TimeOffset, IsNotClearForRepetitiveMotion) {
  std::vector<ImuSample> imu = exampleImu(1.0);
  for (ImuSample& sample : imu)
    sample.gyro =
        Eigen::Vector3d(std::sin(2 * M_PI * 3.0 * 1e-9 * static_cast<double>(sample.t)), 0, 0);
  std::vector<RotationStep> steps = exampleSteps(0, 0);
  for (RotationStep& step : steps)
    step.rotation = {
        0.05 * std::sin(2 * M_PI * 3.0 * 0.5e-9 * static_cast<double>(step.t0 + step.t1)), 0, 0};
  const auto estimate = estimateTimeOffset(steps, imu, 0.45, kR_CB);
  EXPECT_FALSE(estimate.clear);
  EXPECT_THAT(estimate.reason, HasSubstr("repetitive"));
  EXPECT_FALSE(estimate.R_CB.has_value());
}

TEST(TimeOffset, IsNotClearForNoiseAndNotEstimatedAtRest) {
  std::vector<RotationStep> noise = exampleSteps(0, 0.03);
  for (size_t i = 0; i < noise.size(); ++i) noise[i].rotation -= exampleSteps(0, 0)[i].rotation;
  EXPECT_FALSE(estimateTimeOffset(noise, exampleImu(1.0), 0.5, kR_CB).clear);
  std::vector<RotationStep> rest = exampleSteps(0, 0);
  for (RotationStep& step : rest) step.rotation *= 1e-3;
  const auto estimate = estimateTimeOffset(rest, exampleImu(1e-3), 0.5, kR_CB);
  EXPECT_FALSE(estimate.estimated);
  EXPECT_THAT(estimate.reason, HasSubstr("hardly changes"));
  EXPECT_FALSE(estimateTimeOffset(exampleSteps(0, 0, 20), exampleImu(1.0), 0.5, kR_CB).estimated);
}

}  // namespace
}  // namespace etalon
