// What only real recordings show. Registered where ETALON_REAL_DATA holds them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "etalon/frontend/recording_inspection.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kEuroc = ETALON_EUROC_FOLDER;

TEST(RealRecording, GivesNoWarningAndNoTimeOffset) {
  for (const char* name : {"MH_01_easy_real", "V1_01_easy_real"}) {
    const RecordingInspection found = inspectRecording(*openRecording((kEuroc / name).string()));
    EXPECT_TRUE(found.info.warnings.empty()) << found.info.warnings.front();
    EXPECT_TRUE(found.info.errors.empty()) << found.info.errors.front();
    EXPECT_FALSE(found.time_offset.discernible()) << found.time_offset.offset_s;
  }
}

/** MH_01 in flight, with its IMU or calibration spoilt. */
class SpoiltRecording : public ::testing::Test {
 protected:
  SpoiltRecording() {
    fs::copy(kEuroc / "MH_01_easy_real/mav0", mav0, fs::copy_options::recursive);
    fs::permissions(mav0 / "imu0/data.csv", fs::perms::owner_write, fs::perm_options::add);
    fs::permissions(mav0 / "cam0/sensor.yaml", fs::perms::owner_write, fs::perm_options::add);
  }

  void rewriteImu(TimeNs shift, double gyro_scale) const {
    std::ostringstream csv;
    csv.precision(17);
    const auto source = openRecording(mav0.string());
    for (const ImuSample& s : source->imuSamples())
      csv << s.t + shift << "," << gyro_scale * s.gyro.x() << "," << gyro_scale * s.gyro.y() << ","
          << gyro_scale * s.gyro.z() << "," << s.accel.x() << "," << s.accel.y() << ","
          << s.accel.z() << "\n";
    writeText(mav0 / "imu0/data.csv", csv.str());
  }

  RecordingInspection inspect() const { return inspectRecording(*openRecording(mav0.string())); }

  TemporaryFolder folder;
  const fs::path mav0 = folder / "mav0";
};

TEST_F(SpoiltRecording, AWrongTimeOffsetIsNoticedAndMeasured) {
  rewriteImu(80'000'000, 1.0);
  const RecordingInspection found = inspect();
  EXPECT_THAT(found.info.warnings, Contains(HasSubstr("time offset")));
  EXPECT_NEAR(found.time_offset.offset_s, 0.08, 0.01);  // 7 s of flight leave some milliseconds
}

TEST_F(SpoiltRecording, AGyroInDegreesIsNoticed) {
  rewriteImu(0, 180 / M_PI);
  EXPECT_THAT(inspect().info.warnings, Contains(HasSubstr("deg/s, expected rad/s")));
}

TEST_F(SpoiltRecording, InvertedExtrinsicsAreNoticed) {
  replaceInFile(mav0 / "cam0/sensor.yaml",
                "[0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,",
                "[0.0148655429818, 0.999557249008, -0.0257744366974, 0.065,");
  replaceInFile(mav0 / "cam0/sensor.yaml",
                "0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,",
                "-0.999880929698, 0.0149672133247, 0.00375618835797, -0.02,");
  replaceInFile(mav0 / "cam0/sensor.yaml",
                "-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,",
                "0.00414029679422, 0.025715529948, 0.999660727178, -0.008,");
  EXPECT_THAT(inspect().info.warnings, Contains(HasSubstr("T_BS sensor to body")));
}

}  // namespace
}  // namespace etalon::testing
