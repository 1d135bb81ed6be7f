#include "etalon/datasets/recording_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>

#include "etalon/core/so3.h"
#include "tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

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
    const auto estimate = estimateTimeOffset(exampleSteps(offset_s, 1e-3), exampleImu(1.0), 0.5);
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
  const auto estimate = estimateTimeOffset(exampleSteps(0.02, 1e-3), exampleImu(180.0 / M_PI), 0.5);
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
    const auto estimate = estimateTimeOffset(steps, imu, 0.2);
    ASSERT_TRUE(estimate.clear) << estimate.reason;
    squares += estimate.offset_s * estimate.offset_s;
    sigmas += estimate.sigma_s;
  }
  const double ratio = std::sqrt(squares / kDraws) / (sigmas / kDraws);
  EXPECT_GT(ratio, 0.7);  // 60 draws leave 9 %
  EXPECT_LT(ratio, 1.4);
}

TEST(TimeOffset, IsDiscernibleOnlyIfItExplainsMoreThanNone) {
  EXPECT_TRUE(estimateTimeOffset(exampleSteps(0.06, 1e-3), exampleImu(1.0), 0.5).discernible());
  const auto none = estimateTimeOffset(exampleSteps(0.0, 3e-3), exampleImu(1.0), 0.5);
  EXPECT_TRUE(none.clear);
  EXPECT_FALSE(none.discernible()) << none.offset_s;
}

TEST(TimeOffset, SeesThatAnAxisIsInverted) {
  std::vector<ImuSample> imu = exampleImu(1.0);
  const auto sound = estimateTimeOffset(exampleSteps(0.0, 1e-3), imu, 0.3);
  EXPECT_LT(sound.correlation_mirrored, sound.correlation - 0.1);
  for (ImuSample& sample : imu) sample.gyro.x() = -sample.gyro.x();
  const auto mirrored = estimateTimeOffset(exampleSteps(0.0, 1e-3), imu, 0.3);
  EXPECT_GT(mirrored.correlation_mirrored, 0.95);
  EXPECT_LT(mirrored.correlation, 0.9);
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
  const auto estimate = estimateTimeOffset(steps, imu, 0.45);
  EXPECT_FALSE(estimate.clear);
  EXPECT_THAT(estimate.reason, HasSubstr("repetitive"));
  EXPECT_FALSE(estimate.R_CB.has_value());
}

TEST(TimeOffset, IsNotClearForNoiseAndNotEstimatedAtRest) {
  std::vector<RotationStep> noise = exampleSteps(0, 0.03);
  for (size_t i = 0; i < noise.size(); ++i) noise[i].rotation -= exampleSteps(0, 0)[i].rotation;
  EXPECT_FALSE(estimateTimeOffset(noise, exampleImu(1.0), 0.5).clear);
  std::vector<RotationStep> rest = exampleSteps(0, 0);
  for (RotationStep& step : rest) step.rotation *= 1e-3;
  const auto estimate = estimateTimeOffset(rest, exampleImu(1e-3), 0.5);
  EXPECT_FALSE(estimate.estimated);
  EXPECT_THAT(estimate.reason, HasSubstr("hardly changes"));
  EXPECT_FALSE(estimateTimeOffset(exampleSteps(0, 0, 20), exampleImu(1.0), 0.5).estimated);
}

TEST(StreamSummary, FindsRateAndGaps) {
  const StreamSummary summary = summarize({0, 10'000'000, 20'000'000, 50'000'000, 60'000'000});
  EXPECT_EQ(summary.count, 5u);
  EXPECT_DOUBLE_EQ(summary.rate_hz, 100.0);
  EXPECT_DOUBLE_EQ(summary.duration_s, 0.06);
  ASSERT_EQ(summary.gaps.size(), 1u);
  EXPECT_EQ(summary.gaps[0].after, 20'000'000);
  EXPECT_DOUBLE_EQ(summary.gaps[0].length_s, 0.03);
  EXPECT_EQ(summarize({}).count, 0u);
  EXPECT_EQ(summarize({7}).rate_hz, 0);
}

class RecordingInfoOfFolder : public ::testing::Test {
 protected:
  RecordingInfoOfFolder() {
    writeTinyRecording(folder.path());
    writeImu(1.0, 9.81, 200);
  }

  /** At rest, with the data sheet's noise. */
  void writeImu(double gyro_scale, double gravity, double rate_hz, double rate_rps = 0.05) {
    std::mt19937 generator(1);
    std::normal_distribution<double> noise;
    std::ostringstream csv;
    csv.precision(12);
    for (int i = -20; i < 100; ++i) {
      csv << kFirstStamp + std::llround(1e9 / rate_hz * i);
      for (int k = 0; k < 3; ++k) csv << "," << gyro_scale * (rate_rps + 2.4e-3 * noise(generator));
      for (int k = 0; k < 3; ++k)
        csv << "," << (k == 2 ? gravity : 0.0) + 2.8e-2 * gravity / 9.81 * noise(generator);
      csv << "\n";
    }
    writeText(imu_csv, csv.str());
  }

  std::vector<std::string> warnings() const {
    return describeRecording(*openRecording(folder.path().string())).warnings;
  }
  std::vector<std::string> errors() const {
    return describeRecording(*openRecording(folder.path().string())).errors;
  }

  TemporaryFolder folder;
  const std::filesystem::path imu_csv = folder / "mav0/imu0/data.csv";
  const std::filesystem::path imu_yaml = folder / "mav0/imu0/sensor.yaml";
};

TEST_F(RecordingInfoOfFolder, SoundDataGivesNoWarning) {
  const RecordingInfo info = describeRecording(*openRecording(folder.path().string()));
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_EQ(info.images.count, static_cast<size_t>(kFrames));
  EXPECT_NEAR(info.imu.rate_hz, 200, 1e-3);
  EXPECT_EQ(info.imu.count, 120u);  // the lead of a second included
  EXPECT_TRUE(info.ground_truth_velocity);
  EXPECT_NEAR(info.calibration.baseline(), 0.11, 1e-12);
  EXPECT_NEAR(info.mean_accel_norm, 9.81, 0.02);
  EXPECT_FALSE(info.time_offset.estimated);
}

TEST_F(RecordingInfoOfFolder, UnitMistakesAreNoticed) {
  writeImu(1.0, 1.0, 200);
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("in g"), HasSubstr("m/s^2"))));
  writeImu(1.0, 0.0, 200);
  EXPECT_THAT(warnings(), Contains(HasSubstr("gravity (9.81) included")));
  writeImu(180 / M_PI, 9.81, 200, 0.5);
  EXPECT_THAT(warnings(), Contains(HasSubstr("deg/s")));
}

TEST_F(RecordingInfoOfFolder, NoiseMistakesAreNoticed) {
  const auto withDensity = [this](const std::string& value) {
    const std::string before = readText(imu_yaml);
    replaceInFile(imu_yaml, "1.6968e-04", value);
    const auto found = value == "0" ? errors() : warnings();
    writeText(imu_yaml, before);
    return found;
  };
  EXPECT_THAT(withDensity("0"),
              Contains(AllOf(HasSubstr(imu_yaml.string()), HasSubstr("gyroscope_noise_density"),
                             HasSubstr("zero"), HasSubstr("expected"))));
  EXPECT_THAT(withDensity("2.4e-3"), Contains(HasSubstr("discrete-time")));
  // Below the absolute limit, but 9 times what the quietest half second shows.
  EXPECT_THAT(withDensity("1.6e-3"), Contains(HasSubstr("quietest half second")));
  EXPECT_THAT(withDensity("1e-9"), Contains(HasSubstr("implausibly small")));
  EXPECT_THAT(withDensity("4e-4"), ::testing::IsEmpty());
}

TEST_F(RecordingInfoOfFolder, GapsRatesAndMissingFilesAreNoticed) {
  replaceLine(imu_csv, 50, "");
  replaceLine(imu_csv, 51, "");
  std::filesystem::remove(folder / ("mav0/cam1/data/" + std::to_string(frameStamp(4)) + ".png"));
  EXPECT_THAT(warnings(), AllOf(Contains(AllOf(HasSubstr("IMU: 1 gap"), HasSubstr("0.0150 s"))),
                                Contains(HasSubstr("1 of 6 pairs do not exist"))));
  writeImu(1.0, 9.81, 100);
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("says 200 Hz"), HasSubstr("say 100 Hz"))));
}

TEST_F(RecordingInfoOfFolder, ImagesThatReplayRefusesAreNoticed) {
  const auto image = folder / ("mav0/cam0/data/" + std::to_string(frameStamp(0)) + ".png");
  const std::string png = readText(image);
  writeText(image, "this is no PNG");
  EXPECT_THAT(warnings(),
              AllOf(Contains(AllOf(HasSubstr("1 of 6 pairs cannot be used"), HasSubstr(image))),
                    Contains(AllOf(HasSubstr("no run can start"), HasSubstr("expected a PNG")))));
  // The header is sound: decoding alone shows what is wrong.
  std::string spoilt = png;
  for (size_t i = 60; i < png.size() - 60; ++i) spoilt[i] = 'x';
  writeText(image, spoilt);
  EXPECT_THAT(warnings(), Contains(HasSubstr("no run can start")));
  writeText(image, png);
  replaceInFile(folder / "mav0/cam1/sensor.yaml", "resolution: [64, 48]", "resolution: [48, 64]");
  EXPECT_THAT(warnings(), AllOf(Contains(HasSubstr("6 of 6 pairs cannot be used")),
                                Contains(HasSubstr("found 64x48"))));
}

TEST_F(RecordingInfoOfFolder, ImagesOutsideTheImusTimeAreNoticed) {
  std::string text = readText(imu_csv);
  text.resize(text.find('\n', text.size() / 3) + 1);
  writeText(imu_csv, text);
  EXPECT_THAT(warnings(), Contains(HasSubstr("lie outside the IMU's time")));
}

TEST_F(RecordingInfoOfFolder, MillimetresAreNoticed) {
  const auto camera = folder / "mav0/cam1/sensor.yaml";
  replaceInFile(camera, "0.06,", "60.0,");
  EXPECT_THAT(errors(), Contains(AllOf(HasSubstr(camera.string()), HasSubstr("metres"))));
  replaceInFile(camera, "60.0,", "6.0,");
  EXPECT_THAT(warnings(), Contains(HasSubstr("metres")));
  replaceInFile(camera, "6.0,", "0.06,");
  EXPECT_THAT(errors(), ::testing::IsEmpty());
  writeText(camera, readText(folder / "mav0/cam0/sensor.yaml"));
  EXPECT_THAT(errors(), Contains(AllOf(HasSubstr(camera.string()), HasSubstr("same place"))));
}

TEST_F(RecordingInfoOfFolder, SamplesThatAreNoMeasurementsAreNoticed) {
  replaceLine(imu_csv, 7, std::to_string(kFirstStamp - 70'000'000) + ",1e30,0,0,0,0,9.81");
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("1 of 120 samples are no measurements"),
                                         HasSubstr(std::to_string(kFirstStamp - 70'000'000)))));
  writeImu(1e9, 9.81, 200);
  EXPECT_THAT(errors(), Contains(HasSubstr("120 of 120 IMU samples")));
}

/** Replaces every image of a camera by what `change` makes of the pair. */
void changeImages(const std::filesystem::path& folder, int camera,
                  const std::function<cv::Mat(const cv::Mat& left, const cv::Mat& right)>& change) {
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = std::to_string(frameStamp(i)) + ".png";
    const auto path = [&](int c) {
      return (folder / ("mav0/cam" + std::to_string(c)) / "data" / name).string();
    };
    const cv::Mat left = cv::imread(path(0), cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread(path(1), cv::IMREAD_GRAYSCALE);
    cv::imwrite(path(camera), change(left, right));
  }
}

TEST_F(RecordingInfoOfFolder, ACoveredLensAndLeftEqualToRightAreNoticed) {
  changeImages(folder.path(), 1, [](const cv::Mat& left, const cv::Mat&) { return left; });
  EXPECT_THAT(errors(), Contains(HasSubstr("left and right image are the same")));
  changeImages(folder.path(), 1, [](const cv::Mat& left, const cv::Mat&) {
    return cv::Mat(left.size(), CV_8UC1, cv::Scalar(2));
  });
  EXPECT_THAT(errors(), Contains(HasSubstr("without contrast")));
}

TEST_F(RecordingInfoOfFolder, ACameraThatHangsWhileTheGyroTurnsIsNoticed) {
  const auto image = [this](int i) {
    return folder / ("mav0/cam0/data/" + std::to_string(frameStamp(i)) + ".png");
  };
  writeText(image(3), readText(image(2)));
  EXPECT_THAT(warnings(), ::testing::IsEmpty());  // at rest: a simulator without noise
  writeImu(1.0, 9.81, 200, 0.5);
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("1 of 6 pairs repeat"),
                                         HasSubstr(std::to_string(frameStamp(3))))));
}

}  // namespace
}  // namespace etalon::testing
