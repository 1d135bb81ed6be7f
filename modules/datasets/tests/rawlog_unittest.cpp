#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdlib>
#include <functional>
#include <limits>

#include "etalon/core/errors.h"
#include "etalon/datasets/convert.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/datasets/recording_comment.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/** A source that a conversion reads whole. */
std::unique_ptr<SensorSource> openWhole(const std::string& path, bool decode = true) {
  SourceOptions options;
  options.imu_lead_s = 1e18;
  options.decode_images = decode;
  return openSource(path, options);
}

class Rawlog : public ::testing::Test {
 protected:
  Rawlog() { writeTinyRecording(euroc); }

  ConvertReport convert(const std::string& destination, bool embed) const {
    ConvertOptions options;
    options.embed = embed;
    return convertToRawlog(*openWhole(euroc.string(), embed), destination, options);
  }

  TemporaryFolder folder;
  const fs::path euroc = folder / "recording";
  const std::string log = (folder / "log.rawlog").string();
};

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

TEST_F(Rawlog, AMissingExternalImageIsSkippedOrIfFirstAnError) {
  convert(log, false);
  const auto image = [&](int i) {
    return euroc / "mav0/cam1/data" / (std::to_string(frameStamp(i)) + ".png");
  };
  fs::remove(image(3));
  auto source = openSource(log);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames - 1));
  EXPECT_THAT(source->statistics().warnings, Contains(HasSubstr(image(3).string())));
  fs::remove(image(0));
  source = openSource(log);
  EXPECT_THAT(dataErrorOf([&] { readAll(*source); }), HasSubstr(image(0).string()));
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
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("CObservationStereoImages"));
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

/** Logs of other origin, written object by object. */
class ForeignRawlog : public Rawlog {
 protected:
  ForeignRawlog() {
    const auto source = openWhole(euroc.string());
    calibration = source->calibration();
    events = readAll(*source);
  }

  using Edit = std::function<void(mrpt::obs::CObservationStereoImages&)>;

  /** Without the project's comments. */
  void write(const Edit& edit = {}) {
    RawlogWriter writer(log);
    for (const SensorEvent& event : events) {
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        writer.write(toObservation(*sample));
        continue;
      }
      auto stereo = toObservation(std::get<StereoFrame>(event), calibration);
      if (edit) edit(stereo);
      writer.write(stereo);
    }
    writer.close();
  }

  StereoInertialCalibration calibration;
  std::vector<SensorEvent> events;
};

TEST_F(ForeignRawlog, TakesCalibrationFromTheObservations) {
  write();
  const auto source = openSource(log);
  const StereoInertialCalibration& read = source->calibration();
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_TRUE(read.cameras[c].model == calibration.cameras[c].model);
    // Through quaternions and a product of transforms.
    EXPECT_TRUE(
        read.cameras[c].T_BC.matrix().isApprox(calibration.cameras[c].T_BC.matrix(), 1e-12));
    EXPECT_NEAR(read.cameras[c].rate_hz, 20, 1e-3);
  }
  EXPECT_NEAR(read.imu.rate_hz, 200, 0.1);  // stamps cut down to 100 ns
  EXPECT_THAT(source->statistics().warnings, Contains(HasSubstr("noise model")));
  const auto frames = framesOf(readAll(*source));
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i)
    EXPECT_EQ(frames[static_cast<size_t>(i)].t, truncateToMrptTick(frameStamp(i)));
}

TEST_F(ForeignRawlog, SaysWhatIsMissingInTheCalibration) {
  write([](auto& stereo) { stereo.rightCamera.intrinsicParams.setZero(); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("right camera"), HasSubstr("intrinsic")));
  write([](auto& stereo) { stereo.rightCameraPose = mrpt::poses::CPose3DQuat(); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("baseline"));
  write([](auto& stereo) { stereo.leftCamera.k3(0.1); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("left camera"), HasSubstr("plumb_bob"), HasSubstr("kannala_brandt")));
  write([](auto& stereo) { stereo.hasImageRight = false; });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("left and a right image"));
}

TEST_F(ForeignRawlog, NonMonotonicStampsAreAnError) {
  std::swap(events[0], events[1]);
  write();
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("object 2"), HasSubstr("strictly increasing")));
}

TEST_F(ForeignRawlog, StampsOutsideTheClockAreAnError) {
  using Duration = mrpt::Clock::duration;
  for (const Duration end : {Duration::min(), Duration::max()}) {
    write([end](auto& stereo) { stereo.timestamp = mrpt::Clock::time_point(end); });
    EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
                AllOf(HasSubstr("stereo images"), HasSubstr("1970 to 2096")));
  }
}

TEST_F(ForeignRawlog, NumbersThatAreNoneAreAnError) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  write([nan](auto& stereo) { stereo.leftCamera.cx(nan); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("left camera"), HasSubstr("finite numbers")));
  write([nan](auto& stereo) { stereo.rightCameraPose.x(nan); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("finite numbers of cam1"));
  write([](auto& stereo) { stereo.rightCamera.nrows = 0; });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("right camera"), HasSubstr("at least 1 x 1 px")));
  convert(log, true);
  const std::string whole = readText(log), more = (folder / "more.rawlog").string();
  RawlogWriter writer(more);
  auto pose = toObservation(StampedPose{kFirstStamp - 1000, SE3()}, kGroundTruthLabel);
  pose.pose.mean.x(nan);
  writer.write(pose);
  writer.close();
  writeText(log, readText(more) + whole);
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("finite pose"));
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
  for (const char* wrong : {"4000000000000000000, 1", "0, -1", "9223372036854775807, 5",
                            "-9223372036854775808", "18446744073709551615"})
    EXPECT_THAT(errorOf(wrong), HasSubstr("stamps in ns")) << wrong;
  EXPECT_THAT(errorOf("1e30"), HasSubstr("whole number"));
}

TEST_F(ForeignRawlog, ReadsSensoryFramesInACompressedLog) {
  {
    mrpt::io::CFileGZOutputStream out(log);
    auto archive = mrpt::serialization::archiveFrom(out);
    mrpt::obs::CSensoryFrame frame;
    for (const SensorEvent& event : events) {
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        frame.push_back(std::make_shared<mrpt::obs::CObservationIMU>(toObservation(*sample)));
      } else {
        frame.push_back(std::make_shared<mrpt::obs::CObservationStereoImages>(
            toObservation(std::get<StereoFrame>(event), calibration)));
        archive << frame;
        frame.clear();
      }
    }
  }
  const auto source = openSource(log);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames));
}

TEST_F(ForeignRawlog, IgnoresFurtherObservations) {
  convert(log, true);
  const std::string base = readText(log);
  const std::string more = (folder / "more.rawlog").string();
  RawlogWriter writer(more);
  writer.write(commentObservation(kFirstStamp, "a comment by hand"));
  writer.write(commentObservation(kFirstStamp, "{\"format\": \"something else\"}"));
  ImuSample other{kFirstStamp, Eigen::Vector3d::Ones(), Eigen::Vector3d::Ones()};
  auto imu = toObservation(other);
  imu.sensorLabel = "imu1";
  writer.write(imu);
  writer.write(toObservation(StampedPose{kFirstStamp, SE3()}, "eta.vi_ba"));
  writer.close();
  writeText(more, base + readText(more));
  expectSameRecording(*openWhole(log), *openWhole(more));
  EXPECT_TRUE(openSource(more)->statistics().warnings.empty());
}

TEST_F(ForeignRawlog, ACommentOfAnotherVersionIsAnError) {
  RawlogWriter writer(log);
  writer.write(commentObservation(kFirstStamp, R"({"format": "etalon recording", "version": 99})"));
  writer.close();
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("expected version 1"), HasSubstr("found 99")));
}

}  // namespace
}  // namespace etalon::testing
