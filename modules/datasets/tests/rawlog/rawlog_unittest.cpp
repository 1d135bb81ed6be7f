#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recording_comment.h"
#include "etalon/datasets/recording_info.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class RawlogRoundTrip : public Rawlog, public ::testing::WithParamInterface<bool> {};

TEST_P(RawlogRoundTrip, IsExact) {
  const ConvertReport report = convert(log, GetParam());
  EXPECT_EQ(report.stereo_frames, kFrames);
  EXPECT_EQ(report.imu_samples, 91);
  EXPECT_EQ(report.ground_truth_poses, 36);
  expectSameRecording(*openWhole(euroc.string()), *openWhole(log));
  SourceOptions range;
  range.from_s = 0.1, range.to_s = 0.2;
  expectSameRecording(*openSource(euroc.string(), range), *openSource(log, range));
  const auto source = openSource(log);
  EXPECT_EQ(source->kind(), "rawlog");
  EXPECT_TRUE(source->statistics().warnings.empty());
}

TEST_P(RawlogRoundTrip, IsExactThroughTwoLogs) {
  convert(log, GetParam());
  const std::string second = (folder / "second.rawlog").string();
  ConvertOptions options;
  options.embed = GetParam();
  convertToRawlog(*openWhole(log), second, options);
  expectSameRecording(*openWhole(euroc.string()), *openWhole(second));
}

TEST_P(RawlogRoundTrip, EveryTruncationIsNoticed) {
  convert(log, GetParam());
  const std::string bytes = readText(log);
  // Coarsely through the log, then every byte of the end.
  std::vector<size_t> lengths;
  for (size_t n = 1; n < bytes.size(); n += GetParam() ? 1999 : 499) lengths.push_back(n);
  for (size_t n = bytes.size() - 60; n < bytes.size(); ++n) lengths.push_back(n);
  const std::string cut = (folder / "cut.rawlog").string();
  for (const size_t length : lengths) {
    writeText(cut, bytes.substr(0, length));
    std::vector<std::string> warnings;
    const std::string error =
        dataErrorOf([&] { warnings = openRecording(cut)->statistics().warnings; });
    // Between two objects a log may end; there it is the index that is missing.
    if (error.empty()) {
      EXPECT_THAT(warnings, Contains(HasSubstr("index"))) << length << " of " << bytes.size();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Storage, RawlogRoundTrip, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "Embedded" : "External"; });

TEST_F(Rawlog, PoseOnlyAndMissingGroundTruthStayWhatTheyAre) {
  writeText(euroc / "mav0/state_groundtruth_estimate0/data.csv",
            "1403636584763555584,1,2,3,0.8,0.6,0,0\n1403636584773555584,1,2,3.5,1,0,0,0\n");
  convert(log, false);
  expectSameRecording(*openWhole(euroc.string()), *openWhole(log));
  fs::remove_all(euroc / "mav0/state_groundtruth_estimate0");
  convert(log, false);
  EXPECT_TRUE(openSource(log)->groundTruth().empty());
}

TEST_F(Rawlog, FindsExternalImagesFromAnyWorkingDirectoryAndAfterAMove) {
  const std::string inside = (euroc / "log.rawlog").string();
  convert(inside, false);
  EXPECT_EQ(readText(inside).find(folder.path() + "/recording/mav0/cam0"), std::string::npos);
  const fs::path moved = folder / "elsewhere";
  fs::rename(euroc, moved);
  const auto source = openSource((moved / "log.rawlog").string());
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames));

  const fs::path before = fs::current_path();
  fs::current_path(moved / "mav0");
  const auto relative = openSource("../log.rawlog");
  fs::current_path(before);
  EXPECT_EQ(framesOf(readAll(*relative)).size(), static_cast<size_t>(kFrames));
}

TEST_F(Rawlog, AMissingExternalImageIsSkipped) {
  convert(log, false);
  const auto image = [&](int i) {
    return euroc / "mav0/cam1/data" / (std::to_string(frameStamp(i)) + ".png");
  };
  for (const int missing : {3, 0}) {
    fs::remove(image(missing));
    const auto source = openSource(log);
    EXPECT_EQ(framesOf(readAll(*source)).size(),
              static_cast<size_t>(missing == 3 ? kFrames - 1 : kFrames - 2));
    EXPECT_THAT(source->statistics().warnings, Contains(HasSubstr(image(missing).string())));
  }
}

TEST_F(Rawlog, EmbeddedImagesCannotBecomeExternal) {
  convert(log, true);
  const std::string other = (folder / "other.rawlog").string();
  EXPECT_THAT(dataErrorOf([&] { convertToRawlog(*openWhole(log), other); }), HasSubstr("--embed"));
  EXPECT_FALSE(fs::exists(other));
}

TEST_F(Rawlog, AnInterruptedConversionLeavesNothing) {
  ConvertOptions options;
  options.progress = [](const ConvertProgress& progress) {
    if (progress.frames == 3) throw std::runtime_error("interrupted");
  };
  const auto source = openWhole(euroc.string());
  EXPECT_THROW(convertToRawlog(*source, log, options), std::runtime_error);
  size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1u);  // the recording
}

TEST_F(Rawlog, AFolderThatIsNotThereIsAnError) {
  EXPECT_THAT(dataErrorOf([&] { convert((folder / "none/log.rawlog").string(), false); }),
              HasSubstr("cannot be created"));
}

TEST_F(Rawlog, OtherFilesAreNoRawlogs) {
  writeText(log, "Once upon a time there was a file that was no log at all.");
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr(log), HasSubstr("expected an MRPT rawlog")));
  writeText(log, "");
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("log.rawlog: the file is empty"));
}

TEST_F(Rawlog, IsKnownByItsContentWhateverItsName) {
  convert(log, false);
  const std::string other = (folder / "log.of_mine").string();
  fs::rename(log, other);
  EXPECT_EQ(openSource(other)->kind(), "rawlog");
}

TEST_F(Rawlog, SaysWhatToDoWhereTheImagesHaveMoved) {
  convert(log, false);
  fs::rename(euroc, folder / "moved");
  EXPECT_THAT(dataErrorOf([&] { readAll(*openSource(log)); }),
              AllOf(HasSubstr("there is no such image file (of 6"), HasSubstr("or with --embed")));
  EXPECT_THAT(describeRecording(*openRecording(log)).errors,
              Contains(AllOf(HasSubstr("the files of 6 of 6 pairs do not exist; "),
                             HasSubstr("or with --embed"))));
}

TEST_F(Rawlog, RawlogEditReadsIt) {
  const std::string tool = ETALON_RAWLOG_EDIT;
  if (tool.empty()) GTEST_SKIP() << "rawlog-edit (package mrpt-apps) is not installed";
  for (const bool embed : {false, true}) {
    convert(log, embed);
    const std::string output = (folder / "output.txt").string();
    const std::string command = tool + " --info -i '" + log + "' > '" + output + "' 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << readText(output);
    const std::string text = readText(output);
    // 91 IMU samples, 6 stereo frames, 36 poses, 2 comments.
    EXPECT_THAT(text, AllOf(HasSubstr(": 135\n"), HasSubstr("ground_truth, imu0, stereo")));
  }
}

TEST_F(Rawlog, TheCommentsAreCheckedAsTheFilesAre) {
  const auto source = openWhole(euroc.string());
  RecordingComment comment;
  comment.calibration = source->calibration();
  comment.stereo_label = kStereoLabel;
  comment.imu_label = kImuLabel;
  const std::string good = toJson(comment);
  const auto errorWith = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const size_t at = text.find(from);
    if (at == std::string::npos) return "no '" + from + "' in the comment";
    convert(log, true);
    const std::string whole = readText(log), first = (folder / "first.rawlog").string();
    RawlogWriter writer(first);
    writer.write(commentObservation(kFirstStamp, text.replace(at, from.size(), to)));
    writer.close();
    writeText(log, readText(first) + whole);
    return dataErrorOf([&] { openSource(log); });
  };
  EXPECT_THAT(errorWith("64,", "6.4e30,"), HasSubstr("whole number"));
  EXPECT_THAT(errorWith("64,", "-64,"), HasSubstr("pixels"));
  EXPECT_THAT(errorWith("45.5,", "-45.5,"),
              AllOf(HasSubstr("focal lengths"), HasSubstr("of cam0")));
  EXPECT_THAT(errorWith("45.5,", "1e999,"), HasSubstr("cannot be used"));
  EXPECT_THAT(errorWith("\"rate_hz\": 200", "\"rate_hz\": -200"), HasSubstr("noise densities"));
  EXPECT_THAT(errorWith("\"version\": 1", "\"version\": 1e40"), HasSubstr("whole number"));
}

TEST(RecordingIndexTest, StampsThatDoNotFitAreAnError) {
  const auto errorOf = [](const std::string& stamps) {
    return dataErrorOf([&] {
      recordingIndexFromJson(
          R"({"version": 1, "stamps_ns": {"imu": [], "images": [)" + stamps + "]}}", "a.rawlog");
    });
  };
  EXPECT_EQ(errorOf("4000000000000000000, -1"), "");
  for (const char* wrong :
       {"4000000000000000000, 1", "0, -1", "9223372036854775807, 5", "-9223372036854775808",
        "18446744073709551615", "5, 18446744073709551615"})
    EXPECT_THAT(errorOf(wrong), HasSubstr("stamps in ns")) << wrong;
  EXPECT_THAT(errorOf("1e30"), HasSubstr("whole number"));
}

}  // namespace
}  // namespace etalon::testing
