// What only real recordings show. Registered where ETALON_REAL_DATA holds them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "etalon/datasets/convert.h"
#include "etalon/datasets/recording_info.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kEuroc = ETALON_EUROC_FOLDER;

class RealRecording : public ::testing::TestWithParam<const char*> {
 protected:
  const std::string path = (kEuroc / GetParam()).string();
};

TEST_P(RealRecording, GivesNoWarning) {
  const auto source = openRecording(path);
  const RecordingInfo info = describeRecording(*source);
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_TRUE(info.errors.empty()) << info.errors.front();
  readAll(*source);
  EXPECT_TRUE(source->statistics().warnings.empty());
  EXPECT_EQ(source->statistics().stereo_frames, static_cast<int>(info.images.count));
}

TEST_P(RealRecording, RoundTripsThroughRawlogs) {
  const TemporaryFolder folder;
  for (const bool embed : {false, true}) {
    SCOPED_TRACE(embed);
    const std::string log = (folder / "log.rawlog").string();
    SourceOptions whole;
    whole.imu_margin_s = 1e18;
    ConvertOptions options;
    options.embed = embed;
    convertToRawlog(*openSource(path, whole), log, options);
    expectSameRecording(*openSource(path), *openSource(log));
  }
}

INSTANTIATE_TEST_SUITE_P(, RealRecording, ::testing::Values("MH_01_easy_real", "V1_01_easy_real"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace etalon::testing
