#include "suite/open_recordings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "etalon/benchmark/content_hash.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

class OpenRecordings : public ::testing::Test {
 protected:
  OpenRecordings() {
    for (const char* name : {"a", "b"}) {
      std::filesystem::create_directories(folder_ / name);
      testing::writeTinyRecording(folder_ / name);
    }
  }
  std::string path(const std::string& name) const { return folder_ / name; }

  testing::TemporaryFolder folder_;
  std::vector<BenchmarkSequence> sequences_;
};

TEST_F(OpenRecordings, DescribesThem) {
  const auto opened = openRecordings({path("a"), path("b")}, "", &sequences_);
  ASSERT_EQ(opened.size(), 2U);
  ASSERT_EQ(sequences_.size(), 2U);
  const BenchmarkSequence& a = sequences_[0];
  EXPECT_EQ(a.name, "a");
  EXPECT_EQ(a.source, path("a"));
  EXPECT_EQ(a.source_kind, "euroc");
  EXPECT_EQ(a.stereo_frames, testing::kFrames);
  EXPECT_EQ(a.first_image, testing::kFirstStamp);
  EXPECT_EQ(a.last_image, testing::frameStamp(testing::kFrames - 1));
  EXPECT_NEAR(a.duration_s, 0.25, 1e-6);
  EXPECT_TRUE(a.has_ground_truth);
  EXPECT_EQ(a.error, "");
  EXPECT_EQ(a.content, "");  // hashed where it is needed
}

TEST_F(OpenRecordings, OneThatCannotBeUsedSaysWhy) {
  std::filesystem::remove(folder_ / "b" / "mav0" / "imu0" / "data.csv");
  const auto opened = openRecordings({path("a"), path("b"), path("c")}, "", &sequences_);
  EXPECT_TRUE(opened[0]);
  EXPECT_FALSE(opened[1]);
  EXPECT_FALSE(opened[2]);
  EXPECT_THAT(sequences_[1].error, HasSubstr("imu0"));
  EXPECT_NE(sequences_[2].error, "");
  EXPECT_EQ(sequences_[2].name, "c");
}

TEST_F(OpenRecordings, NamesAreThereOnce) {
  EXPECT_THROW(openRecordings({path("a"), path("b/../a")}, "", &sequences_), ConfigError);
}

TEST_F(OpenRecordings, TakeAnotherGroundTruth) {
  const auto own = openRecordings({path("a"), path("b")}, "", &sequences_);
  const std::string line = " 1 2 3 0 0 0 1\n";
  writeFile(folder_ / "b.tum", "1.0" + line + "2.0" + line);
  sequences_.clear();
  const auto opened = openRecordings({path("a"), path("b")}, folder_.path(), &sequences_);
  ASSERT_TRUE(opened[0]);  // the recording `a` of the folder: itself
  ASSERT_TRUE(opened[1]);
  EXPECT_EQ(opened[1]->groundTruth().states.size(), 2U);
  EXPECT_THAT(sequences_[1].warnings, ::testing::Contains(HasSubstr("b.tum")));
  EXPECT_NE(contentOf(*opened[1]), contentOf(*own[1]));
  EXPECT_EQ(contentOf(*own[1]), recordingHash(*opened[1]));
}

TEST_F(OpenRecordings, WithoutTheOtherGroundTruthTheyAreNotUsed) {
  std::filesystem::create_directories(folder_ / "truths");
  const auto opened = openRecordings({path("a")}, folder_ / "truths", &sequences_);
  EXPECT_FALSE(opened[0]);
  EXPECT_THAT(sequences_[0].error, HasSubstr("no ground truth of 'a'"));
}

TEST(InitializerRecords, HoldWhatAPluginWas) {
  ConfiguredInitializer initializer;
  initializer.plugin.name = "one";
  initializer.plugin.version = "2.1";
  initializer.plugin.path = "/proc/self/exe";
  initializer.ini = "[one]\n";
  const std::vector<BenchmarkInitializer> records = initializerRecords({initializer});
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records[0].name, "one");
  EXPECT_EQ(records[0].version, "2.1");
  EXPECT_EQ(records[0].config, "[one]\n");
  EXPECT_EQ(records[0].binary.size(), 32U);
}

}  // namespace
}  // namespace etalon
