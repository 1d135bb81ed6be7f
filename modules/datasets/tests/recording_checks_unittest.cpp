// What is wrong with a recording, at the bounds of each check, on a reader without files.

#include "etalon/datasets/recording_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

/** Three seconds at rest, 200 Hz, noise of a MEMS sensor; two pairs of images. */
Recording soundRecording() {
  Recording recording;
  recording.calibration.cameras[1].T_BC.t.x() = 0.11;
  recording.image_stamps = {0, 50'000'000};
  for (int i = 0; i < 600; ++i) {
    // Alternating signs are noise of that size to second differences.
    const double sign = i % 2 ? 1.0 : -1.0;
    recording.imu.push_back({5'000'000LL * i, Eigen::Vector3d::Constant(sign * 1.7e-4 * 14.1),
                             Eigen::Vector3d(0.0, 0.0, 9.81 + sign * 2e-3 * 14.1)});
  }
  return recording;
}

class FixedReader : public RecordingReader {
 public:
  explicit FixedReader(Recording recording) : recording_(std::move(recording)) {}
  Recording read() override { return recording_; }
  LoadedFrame load(size_t, bool) override { return {}; }
  std::pair<std::string, std::string> paths(size_t) const override { return {}; }
  std::vector<RecordingFile> files() const override { return {}; }
  std::string calibrationFile(const std::string& sensor) const override { return sensor + ".yaml"; }

 private:
  Recording recording_;
};

template <typename Check>
RecordingFindings found(Recording recording, const Check& check) {
  return check(
      RecordedSource("flight", "fixed", std::make_unique<FixedReader>(std::move(recording)), {}));
}

RecordingFindings ofBaseline(double metres) {
  Recording recording = soundRecording();
  recording.calibration.cameras[1].T_BC.t = {0.0, metres, 0.0};
  return found(recording, checkCalibration);
}

TEST(RecordingChecks, ASoundRecordingHasNoFindings) {
  for (const auto check : {checkCalibration, checkImu, checkRepeatedImages}) {
    const RecordingFindings findings = found(soundRecording(), check);
    EXPECT_THAT(findings.errors, IsEmpty());
    EXPECT_THAT(findings.warnings, IsEmpty());
  }
}

TEST(RecordingChecks, TheBaselineIsInMetres) {
  for (const double sound : {0.0051, 0.04, 0.11, 1.0, 4.99}) {
    EXPECT_THAT(ofBaseline(sound).errors, IsEmpty()) << sound;
    EXPECT_THAT(ofBaseline(sound).warnings, IsEmpty()) << sound;
  }
  for (const double unlikely : {2e-4, 4.9e-3, 5.1, 19.9})
    EXPECT_THAT(ofBaseline(unlikely).warnings, ElementsAre(HasSubstr("is unlikely"))) << unlikely;
  EXPECT_THAT(ofBaseline(9e-5).errors, ElementsAre(HasSubstr("stand in the same place")));
  EXPECT_THAT(ofBaseline(110.0).errors,
              ElementsAre(HasSubstr("cam1.yaml: extrinsics: a stereo baseline of 110 m; expected "
                                    "T_BS in metres, are they millimetres?")));
}

TEST(RecordingChecks, CamerasHaveOneSize) {
  Recording recording = soundRecording();
  recording.calibration.cameras[1].model =
      CameraModel("pinhole", "radial-tangential", 376, 240, {200, 200, 188, 120}, {0, 0, 0, 0});
  EXPECT_THAT(found(recording, checkCalibration).errors, ElementsAre(HasSubstr("of one size")));
}

/** Microseconds and milliseconds that are read as nanoseconds; 200 Hz are none. */
TEST(RecordingChecks, StampsAreNanoseconds) {
  Recording recording = soundRecording();
  for (const auto& [step, unit] : {std::pair<TimeNs, const char*>{50'000, "microseconds"},
                                   std::pair<TimeNs, const char*>{50, "milliseconds"}}) {
    recording.image_stamps = {0, step, 2 * step};
    EXPECT_THAT([&] { found(recording, checkImu); }, ThrowsMessage<DataError>(HasSubstr(unit)));
  }
  recording.image_stamps = {0, 5'000'000, 10'000'000};
  EXPECT_THAT(found(recording, checkImu).errors, IsEmpty());
}

TEST(RecordingChecks, DensitiesAreThoseOfContinuousTime) {
  const auto with = [](double ImuNoiseDensities::*density, double value) {
    Recording recording = soundRecording();
    recording.calibration.imu.noise.*density = value;
    return found(recording, checkCalibration);
  };
  const auto accel = &ImuNoiseDensities::accel_noise_density;
  EXPECT_THAT(
      with(accel, 0.0).errors,
      ElementsAre(HasSubstr("imu0.yaml: noise model: accelerometer_noise_density is zero")));
  EXPECT_THAT(with(accel, 9e-6).warnings, ElementsAre(HasSubstr("implausibly small")));
  EXPECT_THAT(with(accel, 2.1e-2).warnings, ElementsAre(HasSubstr("implausibly large")));
  // The quietest half second has some 1.6 times the alternating noise, in one of three axes.
  EXPECT_THAT(with(accel, 8e-3).warnings, IsEmpty());
  EXPECT_THAT(with(accel, 1.9e-2).warnings, ElementsAre(HasSubstr("quietest half second")));
  EXPECT_THAT(with(&ImuNoiseDensities::gyro_random_walk, 0.0).warnings,
              ElementsAre(HasSubstr("gyroscope_random_walk = 0 rad/s^2/sqrt(Hz) is implausibly "
                                    "small; 1e-07 is used")));
  EXPECT_THAT(with(&ImuNoiseDensities::accel_random_walk, 0.11).warnings,
              ElementsAre(HasSubstr("accelerometer_random_walk = 0.11 m/s^3/sqrt(Hz) is")));
  EXPECT_THAT(with(&ImuNoiseDensities::accel_random_walk, 0.09).warnings, IsEmpty());
}

RecordingFindings ofAccelerations(double mps2) {
  Recording recording = soundRecording();
  for (ImuSample& sample : recording.imu) sample.accel = {0.0, -mps2, 0.0};
  return found(recording, checkImu);
}

TEST(RecordingChecks, TheAccelerometerFeelsGravityInMetresASecondSquared) {
  EXPECT_THAT(ofAccelerations(0.49).warnings, ElementsAre(HasSubstr("gravity (9.81) included")));
  EXPECT_THAT(ofAccelerations(1.0).warnings, ElementsAre(HasSubstr("seems to be in g")));
  EXPECT_THAT(ofAccelerations(1.99).warnings, ElementsAre(HasSubstr("seems to be in g")));
  EXPECT_THAT(ofAccelerations(6.9).warnings, ElementsAre(HasSubstr("expected about 9.81")));
  EXPECT_THAT(ofAccelerations(7.1).warnings, IsEmpty());
  EXPECT_THAT(ofAccelerations(12.9).warnings, IsEmpty());
  EXPECT_THAT(ofAccelerations(13.1).warnings, ElementsAre(HasSubstr("expected about 9.81")));
}

TEST(RecordingChecks, RatesThatNoCameraFollowsAreNotInRadians) {
  const auto with = [](size_t samples, double rps) {
    Recording recording = soundRecording();
    for (size_t i = 0; i < samples; ++i) recording.imu[i].gyro = {rps, 0.0, 0.0};
    return found(recording, checkImu).warnings;
  };
  EXPECT_THAT(with(1, 34.9), IsEmpty());
  EXPECT_THAT(with(1, 35.1), ElementsAre(HasSubstr("are they in deg/s?")));
  EXPECT_THAT(with(290, 10.0), IsEmpty());
  EXPECT_THAT(with(310, 10.0), ElementsAre(HasSubstr("10 (median) and 10 (largest)")));
}

TEST(RecordingChecks, SamplesThatAreNoMeasurementsAreCountedAndMostOfThemAreAnError) {
  const auto with = [](size_t samples) {
    Recording recording = soundRecording();
    for (size_t i = 0; i < samples; ++i) recording.imu[i + 3].accel.x() = 1e6;
    return found(recording, checkImu);
  };
  EXPECT_THAT(with(2).warnings,
              ElementsAre(HasSubstr("IMU: 2 of 600 samples are no measurements and are dropped; "
                                    "the first at stamp 15000000")));
  EXPECT_THAT(with(300).errors, IsEmpty());
  EXPECT_THAT(with(301).errors,
              ElementsAre(HasSubstr("flight: 301 of 600 IMU samples are no measurements")));
  // They do not enter the mean.
  EXPECT_EQ(with(300).warnings.size(), 1U);
}

TEST(RecordingChecks, SamplesThatAreNoMeasurementsSpoilNoOtherCheck) {
  Recording recording = soundRecording();
  recording.calibration.imu.noise.gyro_noise_density = 1.9e-3;
  for (ImuSample& sample : recording.imu) sample.gyro *= 0.5;  // 22 times less than that
  recording.imu[5].gyro.x() = std::nan("");  // in the half second that is looked at first
  recording.imu[300].gyro.y() = 5000.0;
  recording.imu[599].accel.z() = HUGE_VAL;
  EXPECT_THAT(found(recording, checkCalibration).warnings,
              ElementsAre(HasSubstr("quietest half second")));
  const RecordedSource source("flight", "fixed", std::make_unique<FixedReader>(recording), {});
  EXPECT_EQ(source.imuSamples().size(), 600U);
  const std::vector<ImuSample> measurements = source.imuMeasurements();
  ASSERT_EQ(measurements.size(), 597U);
  for (const ImuSample& sample : measurements) EXPECT_LT(sample.gyro.norm(), 0.1);
}

}  // namespace
}  // namespace etalon
