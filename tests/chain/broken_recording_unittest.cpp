#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/** Replays one second, too little to initialize: what is wrong shows earlier. */
CommandResult replayBriefly(const std::string& source, const std::string& out) {
  return runEtalon({"replay", source, "--to", "1", "--out", out});
}

/** Expects that info and replay refuse the recording, and their messages. */
void expectRefused(const std::string& source, const std::vector<std::string>& expected) {
  const TemporaryFolder folder;
  for (const CommandResult& result :
       {runEtalon({"info", source}), replayBriefly(source, folder.path() + "/run")}) {
    EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
    for (const std::string& text : expected) EXPECT_THAT(result.err, HasSubstr(text));
  }
}

TEST(BrokenRecording, AMissingOrWrongCalibrationIsRefused) {
  const std::string camera = "cam0/sensor.yaml", imu = "imu0/sensor.yaml";
  {
    const RecordingCopy copy(kFlight);
    std::filesystem::remove(copy.file(camera));
    expectRefused(copy.path(), {copy.file(camera), "there is no such file"});
  }
  {
    const RecordingCopy copy(kFlight);
    copy.replace(camera, "intrinsics:", "intrinsic:");
    expectRefused(copy.path(),
                  {copy.file(camera), "the key 'intrinsics' is missing", "[fu, fv, cu, cv]"});
  }
  {
    const RecordingCopy copy(kFlight);
    copy.replace(camera, "intrinsics: [", "intrinsics: [wide, ");
    expectRefused(copy.path(), {copy.file(camera) + ":", "intrinsics"});
  }
  {
    const RecordingCopy copy(kFlight);
    copy.replace(imu, "gyroscope_noise_density:", "gyroscope_noise:");
    expectRefused(copy.path(), {copy.file(imu), "'gyroscope_noise_density' is missing"});
  }
}

TEST(BrokenRecording, AWrongLineIsRefusedWithItsNumber) {
  const RecordingCopy words(kFlight);
  words.replace("imu0/data.csv", "\n1400000000000000000,", "\n1400000000000000000,fast,");
  expectRefused(words.path(), {words.file("imu0/data.csv") + ":2"});
  const RecordingCopy twice(kFlight);
  twice.replace("cam0/data.csv", "\n1400000000150000000,", "\n1400000000100000000,");
  expectRefused(twice.path(), {twice.file("cam0/data.csv") + ":3"});
}

TEST(BrokenRecording, TheRunGoesOnWithoutImagesThatCannotBeRead) {
  const RecordingCopy copy(kFlight);
  // At 2 s, inside the window of keyframes, at 2.35 s and 3.6 s.
  std::filesystem::remove(copy.image(0, 40));
  copy.write(copy.image(1, 47), readText(copy.image(1, 47)).substr(0, 5000));
  const std::string small = copy.image(0, 72);
  const cv::Mat quarter = cv::imread(small, cv::IMREAD_GRAYSCALE).rowRange(0, 120).clone();
  std::filesystem::remove(small);
  cv::imwrite(small, quarter);

  const std::string out = copy.path() + "/run";
  const CommandResult result =
      runEtalon({"replay", copy.path(), "--from", kInMotion, "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const json run = readJson(out + "/initialization.json");
  EXPECT_EQ(run.at("statistics").at("unreadable_images"), 3);
  EXPECT_EQ(run.at("statistics").at("stereo_frames"), 57);  // of 60
  EXPECT_EQ(run.at("warnings").size(), 3U);
  for (const std::string& file : {copy.image(0, 40), copy.image(1, 47), small})
    EXPECT_THAT(result.err, HasSubstr("warning: " + file + ": skipped"));
  EXPECT_EQ(readTum(out + "/trajectory.tum").size(), 57U);
  const json errors = errorsAfterViBa(acceptedAttempt(run));
  EXPECT_LT(errors.at("gravity_deg").get<double>(), 2.0);
  EXPECT_LT(errors.at("velocity_mps").get<double>(), 0.1);
}

TEST(BrokenRecording, ImagesThatCannotBeReadAreCountedBeyondThoseThatAreNamed) {
  const RecordingCopy copy(kFlight);
  for (int i = 5; i < 28; ++i) copy.write(copy.image(i % 2, i), "no picture");
  const std::string expected =
      "23 stereo pairs could not be read and were skipped (first 20 named)";
  const CommandResult run =
      runEtalon({"replay", copy.path(), "--to", "1.5", "--out", copy.path() + "/run"});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_THAT(run.out, HasSubstr(expected));
  for (const char* option : {"--embed", ""}) {
    std::vector<std::string> arguments = {"convert", copy.path(), copy.path() + "/log.rawlog"};
    if (*option != '\0') arguments.emplace_back(option);
    const CommandResult converted = runEtalon(arguments);
    EXPECT_EQ(converted.exit_code, 0) << converted.err;
    EXPECT_THAT(converted.out, AllOf(HasSubstr(expected), HasSubstr(" 57 stereo frames")));
    EXPECT_THAT(converted.err, HasSubstr(copy.image(1, 5) + ": skipped"));
  }
}

TEST(BrokenRecording, ConvertRefusesImagesThatAreNotThereOrNotAsCalibrated) {
  const RecordingCopy copy(kFlight);
  const std::string log = copy.path() + "/log.rawlog";
  std::filesystem::remove_all(copy.file("cam0/data"));
  const CommandResult missing = runEtalon({"convert", copy.path(), log});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, AllOf(HasSubstr("no such image file"), HasSubstr("none can be read")));
  const RecordingCopy sizes(kFlight);
  sizes.replace("cam0/sensor.yaml", "resolution: [752, 480]", "resolution: [640, 480]");
  const CommandResult size = runEtalon({"convert", sizes.path(), log});
  EXPECT_EQ(size.exit_code, 3);
  EXPECT_THAT(size.err, AllOf(HasSubstr("640x480"), HasSubstr("found 752x480")));
  EXPECT_FALSE(std::filesystem::exists(log));
}

TEST(BrokenRecording, WithoutAnyFrameAnEarlierRunStays) {
  const RecordingCopy copy(kFlight);
  std::filesystem::remove_all(copy.file("cam0/data"));
  const TemporaryFolder folder;
  const std::string earlier = folder.write("initialization.json", "earlier");
  for (const std::string& out : {folder.path(), folder.path() + "/new"}) {
    const CommandResult result = replayBriefly(copy.path(), out);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.out, IsEmpty());
  }
  EXPECT_EQ(readText(earlier), "earlier");
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/trajectory.tum"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/new"));
}

TEST(BrokenRecording, FramesAfterTheImusEndAreCounted) {
  const RecordingCopy copy(kFlight);
  const std::string csv = readText(copy.file("imu0/data.csv"));
  copy.write(copy.file("imu0/data.csv"), csv.substr(0, csv.find("\n1400000000600000000,") + 1));
  const CommandResult result = replayBriefly(copy.path(), copy.path() + "/run");
  EXPECT_THAT(result.err, HasSubstr("of 21 stereo frames lie outside the IMU's time"));
  const json run = readJson(copy.path() + "/run/initialization.json");
  EXPECT_EQ(run.at("warnings").size(), 1U);
}

TEST(BrokenRecording, AnUnreadableFirstImageIsSkipped) {
  const RecordingCopy copy(kFlight);
  copy.write(copy.image(0, 0), "no picture");
  const CommandResult result = replayBriefly(copy.path(), copy.path() + "/run");
  EXPECT_NE(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr(copy.image(0, 0) + ": skipped"));
}

TEST(BrokenRecording, AnImageWithoutPartnerIsCounted) {
  const RecordingCopy copy(kFlight);
  const std::string name = std::filesystem::path(copy.image(1, 10)).filename().string();
  const std::string stamp = name.substr(0, name.find('.'));
  copy.replace("cam1/data.csv", stamp + "," + name, "#");
  const std::string out = copy.path() + "/run";
  const CommandResult result = replayBriefly(copy.path(), out);
  EXPECT_EQ(result.exit_code, 0) << result.err;  // a second is enough for a start
  EXPECT_THAT(result.out, HasSubstr("1 left and 0 right images without a partner"));
  EXPECT_EQ(readJson(out + "/initialization.json").at("statistics").at("unpaired_left"), 1);
}

TEST(BrokenRecording, WithoutGroundTruthItRunsAndSaysNothingOfErrors) {
  const RecordingCopy copy(kFlight);
  std::filesystem::remove_all(copy.file("state_groundtruth_estimate0"));
  EXPECT_THAT(runEtalon({"info", copy.path()}).out, HasSubstr("ground truth   none"));
  const std::string out = copy.path() + "/run";
  const CommandResult result =
      runEtalon({"replay", copy.path(), "--from", kInMotion, "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(Not(HasSubstr("RRE")), Not(HasSubstr("nan"))));
  EXPECT_THAT(result.out, Not(HasSubstr("ATE")));
  const json run = readJson(out + "/initialization.json");
  EXPECT_FALSE(run.contains("trajectory_errors"));
  const json attempt = acceptedAttempt(run);
  for (const json& stage : attempt.at("stages")) EXPECT_FALSE(stage.contains("errors"));
  EXPECT_FALSE(cv::imread(out + "/trajectory.png").empty());
  EXPECT_EQ(runEtalon({"compare", out}).exit_code, 0);
}

TEST(BrokenRecording, ShorterThanTheWindowItIsNotInitializedAndTheReasonIsPrinted) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/run";
  const CommandResult result = runEtalon({"replay", kFlight, "--to", "0.4", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("shorter than the window of keyframes"));
  EXPECT_THAT(readJson(out + "/initialization.json").at("attempts"), IsEmpty());
  EXPECT_THAT(readText(out + "/trajectory.tum"), StartsWith("# T_VB, never initialized: V is"));
  // Without gravity yaw alone aligns nothing.
  EXPECT_EQ(readJson(out + "/initialization.json")
                .at("trajectory_errors")
                .at("alignment")
                .at("rotation_deg"),
            "SE(3)");
  const CommandResult compared = runEtalon({"compare", out});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("never initialized"));
}

TEST(BrokenRecording, ARangeBeyondTheEndIsRefused) {
  const TemporaryFolder folder;
  const CommandResult result =
      runEtalon({"replay", kFlight, "--from", "60", "--out", folder.path() + "/run"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("from 60"), HasSubstr("3.95")));
}

TEST(BrokenRecording, ATruncatedRawlogIsRefused) {
  const TemporaryFolder folder;
  const std::string log = folder.path() + "/whole.rawlog";
  ASSERT_EQ(runEtalon({"convert", kFlight, log}).exit_code, 0);
  const std::string text = readText(log);
  // The images stay where they are: both logs stand in one folder.
  const std::string cut = folder.write("cut.rawlog", text.substr(0, text.size() / 2 + 7));
  expectRefused(cut, {cut, "truncated"});
}

TEST(BrokenRecording, AnOutputFolderThatCannotBeMadeIsRefusedBeforeTheRun) {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "of mine");
  for (const std::string& out : {file, file + "/below"}) {
    const CommandResult result = replayBriefly(kFlight, out);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, AllOf(HasSubstr(out), HasSubstr("cannot be made"),
                                  Not(HasSubstr("frames/s"))));  // no line of progress
  }
  const std::string log = file + "/below.rawlog";
  const CommandResult result = runEtalon({"convert", kFlight, log});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr(log), HasSubstr("cannot be created")));
}

TEST(BrokenRecording, AResultThatCannotBeWrittenIsNamed) {
  const TemporaryFolder folder;
  const std::string in_the_way = folder.path() + "/run/run.rawlog";
  std::filesystem::create_directories(in_the_way + "/of mine");
  const CommandResult result = replayBriefly(kFlight, folder.path() + "/run");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr(in_the_way));
}

}  // namespace
}  // namespace etalon::testing
