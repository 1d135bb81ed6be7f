// Faults that a run survives, and what it says of them; faults with which no result can be right.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

using Row = std::vector<std::string>;

/** Writes a CSV file anew from its rows (comments are left out); a row that becomes empty goes. */
void changeRows(const RecordingCopy& copy, const std::string& name,
                const std::function<void(int index, Row* row)>& change) {
  std::istringstream in(readText(copy.file(name)));
  std::string out;
  int index = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    Row row;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) row.push_back(word);
    change(index++, &row);
    for (size_t i = 0; i < row.size(); ++i) out += (i == 0 ? "" : ",") + row[i];
    if (!row.empty()) out += "\n";
  }
  copy.write(copy.file(name), out);
}

constexpr const char* kTruth = "state_groundtruth_estimate0/data.csv";

/** Keeps the rows of ground truth [first, last) alone. */
void keepTruth(const RecordingCopy& copy, int first, int last) {
  changeRows(copy, kTruth, [&](int i, Row* row) {
    if (i < first || i >= last) row->clear();
  });
}

CommandResult replay(const std::string& source, const std::string& out,
                     const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"replay", source, "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return runEtalon(arguments);
}

/** The fault's entry in initialization.json; null if there is none. */
json faultOf(const json& run, const std::string& name) {
  if (run.at("statistics").contains("input_faults"))
    for (const json& fault : run.at("statistics").at("input_faults"))
      if (fault.at("fault") == name) return fault;
  return nullptr;
}

/** Expects that replay and bench refuse the recording with these words, info tells them. */
void expectRefused(const RecordingCopy& copy, const std::vector<std::string>& words) {
  const TemporaryFolder folder;
  const CommandResult info = runEtalon({"info", copy.path()});
  EXPECT_EQ(info.exit_code, 3) << info.out;
  const CommandResult run = replay(copy.path(), folder.path() + "/run", {"--to", "0.5"});
  const CommandResult bench = runEtalon({"bench", copy.path(), "--initializers", "eta",
                                         "--keyframes", "4", "--out", folder.path() + "/bench"});
  EXPECT_EQ(run.exit_code, 3) << run.out << run.err;
  EXPECT_EQ(bench.exit_code, 3) << bench.out << bench.err;
  EXPECT_FALSE(fs::exists(folder.path() + "/run"));
  for (const std::string& word : words) {
    EXPECT_THAT(info.out, HasSubstr(word));
    EXPECT_THAT(run.err, HasSubstr(word));
    EXPECT_THAT(bench.err, HasSubstr(word));
  }
}

TEST(SilentFaults, ACalibrationWithWhichNoResultCanBeRightIsRefused) {
  {
    const RecordingCopy copy(kFlight);
    const std::string yaml = readText(copy.file("imu0/sensor.yaml"));
    const size_t at = yaml.find("gyroscope_noise_density: ");
    const size_t end = yaml.find_first_of(" \n", at + 25);
    copy.write(copy.file("imu0/sensor.yaml"), yaml.substr(0, at + 25) + "0" + yaml.substr(end));
    expectRefused(
        copy, {copy.file("imu0/sensor.yaml"), "gyroscope_noise_density is zero", "rad/s/sqrt(Hz)"});
  }
  const RecordingCopy copy(kFlight);
  copy.write(copy.file("cam1/sensor.yaml"), readText(copy.file("cam0/sensor.yaml")));
  expectRefused(copy, {copy.file("cam1/sensor.yaml"), "same place", "T_BS"});
}

TEST(SilentFaults, ExchangedAndEqualCamerasAreRefused) {
  {
    const RecordingCopy copy(kFlight);
    fs::rename(copy.file("cam0/data"), copy.file("data"));
    fs::rename(copy.file("cam1/data"), copy.file("cam0/data"));
    fs::rename(copy.file("data"), copy.file("cam1/data"));
    expectRefused(copy, {"if cam0 and cam1 are exchanged"});
  }
  const RecordingCopy copy(kFlight);
  fs::remove_all(copy.file("cam1/data"));
  fs::copy(copy.file("cam0/data"), copy.file("cam1/data"),
           fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  expectRefused(copy, {"left and right image are the same"});
}

TEST(SilentFaults, AnImpossibleImuSampleIsDroppedAndTold) {
  const RecordingCopy copy(kFlight);
  changeRows(copy, "imu0/data.csv", [](int i, Row* row) {
    if (i == 400) row->at(2) = "1e30";  // at 2 s
  });
  const std::string out = copy.path() + "/run";
  const CommandResult result = replay(copy.path(), out, {"--from", kInMotion});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("1 of"), HasSubstr("samples are no measurements"),
                                HasSubstr("1 IMU sample dropped")));
  const json run = readJson(out + "/initialization.json");
  EXPECT_EQ(faultOf(run, "imu_too_large").at("count"), 1);
  EXPECT_LT(errorsAfterViBa(acceptedAttempt(run)).at("gravity_deg").get<double>(), 2.0);
}

TEST(SilentFaults, ACameraThatHangsIsToldAndItsFramesAreNotLocated) {
  const RecordingCopy copy(kFlight);
  for (int camera = 0; camera < 2; ++camera)
    for (int i = 51; i < 56; ++i) {  // from 2.55 s, in motion
      fs::remove(copy.image(camera, i));
      fs::create_symlink(copy.image(camera, 50), copy.image(camera, i));
    }
  const std::string out = copy.path() + "/run";
  const CommandResult result = replay(copy.path(), out, {"--from", kInMotion, "--to", "3"});
  EXPECT_THAT(result.err, AllOf(HasSubstr("does the camera hang?"), HasSubstr("bit for bit")));
  // The first images after it show the landmarks of before.
  EXPECT_THAT(result.out, HasSubstr("5 frames could not be located"));
  const json run = readJson(out + "/initialization.json");
  EXPECT_EQ(run.at("statistics").at("frames_not_located"), 5);
  EXPECT_EQ(faultOf(run, "frame_repeats_image").at("count"), 5);
}

TEST(SilentFaults, AFlightThatIsLostStartsAnew) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/run";
  const CommandResult result = replay(kFlight, out,
                                      {"--from", kInMotion, "--fault", "covered from=0.9 for=0.3",
                                       "--set", "odometry.max_dead_reckoning_s=0.1"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr(" s  lost: "), HasSubstr(" s  initialized again\n"),
                    HasSubstr("the pose jumped by "), Not(HasSubstr("waiting for motion"))));
  const json run = readJson(out + "/initialization.json");
  int accepted = 0;
  for (const json& attempt : run.at("attempts")) accepted += attempt.at("status") == "success";
  EXPECT_EQ(accepted, 2);
}

const std::string kTenSeconds = ETALON_RENDERED "/ten_seconds_aggressive";

TEST(SilentFaults, TheImuCarriesThePoseOverSecondsWithoutAFrame) {
  // Longer than [odometry] max_dead_reckoning_s and [input] max_gap_s.
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/run";
  const CommandResult result =
      replay(kTenSeconds, out,
             {"--fault", "dropped from=2 for=6", "--set", "odometry.max_dead_reckoning_s=5"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, Not(HasSubstr("lost: neither images nor the IMU")));
  const json run = readJson(out + "/initialization.json");
  // Without the IMU the pose would be off by metres.
  EXPECT_LT(run.at("trajectory_errors").at("position_m").at("rmse").get<double>(), 0.5);
}

TEST(SilentFaults, TheFinalAdjustmentSurvivesALoss) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/run";
  // New tracks alone, then no frame: the frame of the loss is a keyframe, and begins the next window.
  const CommandResult result =
      replay(kTenSeconds, out,
             {"--final-ba", "--fault", "covered from=2 for=0.5, dropped from=2.5 for=6", "--set",
              "odometry.max_dead_reckoning_s=5"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("initialized again"));
  for (const char* name : {"/trajectory_smoothed.tum", "/trajectory_final.tum"}) {
    std::istringstream lines(readText(out + name));
    double before = 0.0;
    for (std::string line; std::getline(lines, line);) {
      if (line[0] == '#') continue;
      const double t = std::stod(line);
      EXPECT_GT(t, before);
      before = t;
    }
    EXPECT_GT(before, 0.0);
  }
}

TEST(SilentFaults, AJumpOfTheClockIsToldAndNothingIsIntegratedAcrossIt) {
  const RecordingCopy copy(kFlight);
  const std::string middle = "1400000002525000000";
  for (const char* name : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv"})
    changeRows(copy, name, [&](int, Row* row) {
      if (row->at(0) > middle)
        row->at(0) = std::to_string(std::stoll(row->at(0)) + 100000000000000000);
    });
  const std::string out = copy.path() + "/run";
  const CommandResult result = replay(copy.path(), out, {"--from", kInMotion});
  EXPECT_THAT(result.err, AllOf(HasSubstr("1 jump of the IMU's stamps"), HasSubstr("1e+08 s")));
  const json run = readJson(out + "/initialization.json");
  EXPECT_EQ(faultOf(run, "imu_jump").at("count"), 1);
  const std::vector<TumLine> trajectory = readTum(out + "/trajectory.tum");
  EXPECT_GT(trajectory.size(), 50U);
  for (const TumLine& line : trajectory)
    for (int axis = 0; axis < 3; ++axis) EXPECT_LT(std::abs(line.pose[axis]), 20.0);  // the room
}

TEST(SilentFaults, GroundTruthThatCoversLittleIsNotTakenForTheWhole) {
  const RecordingCopy copy(kFlight);
  const std::string out = copy.path() + "/run";
  const auto run = [&](const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"--from", "3"};
    all.insert(all.end(), more.begin(), more.end());
    const CommandResult result = replay(copy.path(), out, all);
    EXPECT_THAT(result.out + result.err, Not(HasSubstr("nan")));
    return result;
  };
  // 200 rows a second from 0.1 s before the first image on: 0.3 s of the run from 3 s on.
  keepTruth(copy, 580, 680);
  const CommandResult barely = run();
  EXPECT_THAT(barely.err, AllOf(HasSubstr("ground truth covers"), HasSubstr("--min-coverage")));
  EXPECT_THAT(barely.out, Not(HasSubstr("ATE of the whole trajectory")));
  EXPECT_FALSE(readJson(out + "/initialization.json").contains("trajectory_errors"));
  const CommandResult enough = run({"--min-coverage", "0.1"});
  EXPECT_THAT(enough.out, AllOf(HasSubstr("ATE of the whole trajectory"),
                                HasSubstr("frames have ground truth")));
  // What a run says of itself, compare says too; more can be asked for.
  const CommandResult compared = runEtalon({"compare", out, "--min-coverage", "0.9"});
  EXPECT_EQ(compared.exit_code, 0);
  EXPECT_THAT(compared.err, HasSubstr("ground truth covers"));
  keepTruth(copy, 0, 1);
  EXPECT_THAT(run().err, HasSubstr("is it on the same clock?"));
}

TEST(SilentFaults, GroundTruthOnAnotherClockOrWithoutVelocitiesGivesNoNan) {
  const RecordingCopy clock(kFlight), poses(kFlight);
  changeRows(clock, kTruth, [](int, Row* row) {
    row->at(0) = std::to_string(std::stoll(row->at(0)) + 3600000000000);
  });
  changeRows(poses, kTruth, [](int, Row* row) { row->resize(8); });
  for (const RecordingCopy* copy : {&clock, &poses}) {
    const CommandResult result = replay(copy->path(), copy->path() + "/run", {"--from", kInMotion});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out + result.err, Not(HasSubstr("nan")));
    EXPECT_EQ(result.err.find("same clock") != std::string::npos, copy == &clock);
    EXPECT_EQ(result.out.find("RRE") != std::string::npos, copy == &poses);
    const CommandResult bench =
        runEtalon({"bench", copy->path(), "--initializers", "eta", "--keyframes", "4", "--every",
                   "2", "--out", copy->path() + "/bench", "--tracks", copy->path() + "/tracks"});
    EXPECT_EQ(bench.exit_code, 0) << bench.err;
    EXPECT_THAT(bench.out, Not(HasSubstr("nan")));
    EXPECT_EQ(bench.err.find("ground truth covers 0 of") != std::string::npos, copy == &clock);
  }
}

}  // namespace
}  // namespace etalon::testing
