#include "etalon/datasets/recording_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

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
    return describeRecording(*openRecording(folder.path())).warnings;
  }
  std::vector<std::string> errors() const {
    return describeRecording(*openRecording(folder.path())).errors;
  }

  TemporaryFolder folder;
  const std::filesystem::path imu_csv = folder / "mav0/imu0/data.csv";
  const std::filesystem::path imu_yaml = folder / "mav0/imu0/sensor.yaml";
};

TEST_F(RecordingInfoOfFolder, SoundDataGivesNoWarning) {
  const RecordingInfo info = describeRecording(*openRecording(folder.path()));
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_EQ(info.images.count, static_cast<size_t>(kFrames));
  EXPECT_NEAR(info.imu.rate_hz, 200, 1e-3);
  EXPECT_EQ(info.imu.count, 120u);  // the lead of a second included
  EXPECT_TRUE(info.ground_truth_velocity);
  EXPECT_NEAR(info.calibration.baseline(), 0.11, 1e-12);
  EXPECT_NEAR(info.mean_accel_norm, 9.81, 0.02);
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
  EXPECT_THAT(warnings(),
              Contains(AllOf(HasSubstr("the IMU has 200 Hz"), HasSubstr("say 100 Hz"))));
}

TEST_F(RecordingInfoOfFolder, ImagesThatReplayCannotUseAreNoticed) {
  const auto image = folder / ("mav0/cam0/data/" + std::to_string(frameStamp(0)) + ".png");
  const std::string png = readText(image);
  writeText(image, "this is no PNG");
  EXPECT_THAT(warnings(), Contains(AllOf(HasSubstr("1 of 6 pairs cannot be used"), HasSubstr(image),
                                         HasSubstr("expected a PNG"))));
  writeText(image, png);
  replaceInFile(folder / "mav0/cam1/sensor.yaml", "resolution: [64, 48]", "resolution: [48, 64]");
  EXPECT_THAT(errors(),
              Contains(AllOf(HasSubstr("6 of 6 pairs cannot be used"), HasSubstr("found 64x48"))));
}

TEST_F(RecordingInfoOfFolder, WithoutAnyImageNoResultCanBeRight) {
  std::filesystem::remove_all(folder / "mav0/cam1/data");
  EXPECT_THAT(errors(), Contains(EndsWith("the files of 6 of 6 pairs do not exist")));
}

TEST_F(RecordingInfoOfFolder, ImagesOnAnotherClockAreAnError) {
  std::istringstream before(readText(imu_csv));
  std::string after;
  for (std::string line; std::getline(before, line);)
    after +=
        std::to_string(std::stoll(line) + 5'000'000'000'000) + line.substr(line.find(',')) + "\n";
  writeText(imu_csv, after);
  EXPECT_THAT(errors(), Contains(HasSubstr("none of the 6 pairs lies within the IMU's time")));
}

TEST_F(RecordingInfoOfFolder, ImagesOutsideTheImusTimeAreNoticed) {
  std::string text = readText(imu_csv);
  text.resize(text.find('\n', text.size() / 3) + 1);
  writeText(imu_csv, text);
  EXPECT_THAT(warnings(), Contains(HasSubstr("lie outside the IMU's time")));
}

TEST_F(RecordingInfoOfFolder, ImagesThatEndLongBeforeTheImuAreNoticed) {
  EXPECT_THAT(warnings(), Not(Contains(HasSubstr("they end"))));
  std::string text = readText(imu_csv);
  const std::string line = text.substr(text.rfind('\n', text.size() - 2) + 1);
  text += std::to_string(std::stoll(line) + 20'000'000'000) + line.substr(line.find(','));
  writeText(imu_csv, text);
  EXPECT_THAT(warnings(), Contains(HasSubstr("images: they end 20.")));
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
