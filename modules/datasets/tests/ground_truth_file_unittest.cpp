#include "etalon/datasets/ground_truth_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/datasets/convert.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTum = "1.0 1 2 3 0 0 0 1\n2.0 1 2 3 0 0 0 1\n3.0 1 2 3 0 0 0 1\n";
constexpr const char* kCsv = "#t\n1000000000,1,2,3,1,0,0,0\n2000000000,1,2,4,1,0,0,0\n";

class GroundTruthFile : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = std::filesystem::path(folder_.path()) / name;
    std::filesystem::create_directories(path.parent_path());
    writeFile(path.string(), text);
    return path.string();
  }
  std::string writeRecording(const std::string& name) const {
    std::filesystem::create_directories(folder_ / name);
    testing::writeTinyRecording(folder_ / name);
    return folder_ / name;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(GroundTruthFile, IsCsvTumOrRecording) {
  EXPECT_EQ(readGroundTruth(write("a", kTum)).states.size(), 3U);
  EXPECT_EQ(readGroundTruth(write("b.txt", kCsv)).states.size(), 2U);
  const std::string recording = writeRecording("c");
  EXPECT_EQ(readGroundTruth(recording).states.size(),
            openSource(recording)->groundTruth().states.size());
}

TEST_F(GroundTruthFile, OfAnyLineEndAndWithBlanksOrAByteOrderMarkIsKnown) {
  EXPECT_EQ(readGroundTruth(write("a", "\xEF\xBB\xBF\r\n \t\r\n  # t x, y, z\r\n" +
                                           std::string("1.0 1 2 3 0 0 0 1\r\n")))
                .states.size(),
            1U);
  EXPECT_EQ(readGroundTruth(write("b", "\xEF\xBB\xBF# t x y z\r\n\r\n  \r\n" +
                                           std::string("1,1,2,3,1,0,0,0\r\n2,1,2,4,1,0,0,0\r\n")))
                .states.size(),
            2U);
}

TEST_F(GroundTruthFile, WhatItIsNotIsSaid) {
  EXPECT_THROW(readGroundTruth(folder_.path()), DataError);
  EXPECT_THROW(readGroundTruth(folder_ / "none"), DataError);
}

TEST_F(GroundTruthFile, OfOneRecordingIsTheFileItself) {
  const std::string file = write("one.csv", kCsv), recording = writeRecording("r");
  EXPECT_FALSE(isGroundTruthFolder(file));
  EXPECT_FALSE(isGroundTruthFolder(recording));
  EXPECT_EQ(groundTruthOf("any", file), file);
  EXPECT_EQ(groundTruthOf("any", recording), recording);
}

TEST_F(GroundTruthFile, ARecordingIsWhatOpenRecordingTakesForOne) {
  const std::string recording = writeRecording("r"), log = folder_ / "log.rawlog";
  convertToRawlog(*openSource(recording), log, {});
  std::filesystem::rename(log, folder_ / "log");
  EXPECT_EQ(readGroundTruth(folder_ / "log").states.size(),
            readGroundTruth(recording).states.size());
  try {
    readGroundTruth(write("broken.bag", kTum));
    FAIL() << "expected a DataError";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("ROS 1 bag"));
  }
}

TEST_F(GroundTruthFile, OfSeveralIsFoundByName) {
  EXPECT_TRUE(isGroundTruthFolder(folder_.path()));
  const std::string recording = writeRecording("n");
  EXPECT_EQ(groundTruthOf("n", folder_.path()), recording);
  const std::string data = write("n/data.csv", kCsv);  // what `etalon ground-truth` writes
  EXPECT_EQ(groundTruthOf("n", folder_.path()), data);
  const std::string tum = write("n.tum", kTum);
  EXPECT_EQ(groundTruthOf("n", folder_.path()), tum);
  const std::string csv = write("n.csv", kCsv);
  EXPECT_EQ(groundTruthOf("n", folder_.path()), csv);
  try {
    groundTruthOf("m", folder_.path());
    FAIL() << "expected a DataError";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("m/data.csv"));
  }
}

TEST_F(GroundTruthFile, StandsInPlaceOfTheRecordingsOwn) {
  SourceOptions options;
  options.ground_truth = write("a.tum", kTum);
  const std::string recording = writeRecording("r");
  EXPECT_EQ(openSource(recording, options)->groundTruth().states.size(), 3U);
  // Then its own may be broken.
  write("r/mav0/state_groundtruth_estimate0/data.csv", "1403636580838555648,nan,2,3,1,0,0,0\n");
  EXPECT_THROW(openSource(recording), DataError);
  EXPECT_EQ(openSource(recording, options)->groundTruth().states.size(), 3U);
}

}  // namespace
}  // namespace etalon
