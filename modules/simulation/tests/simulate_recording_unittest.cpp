#include "etalon/simulation/simulate_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::string contents(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/** All files below `root`, by relative path. */
std::map<std::string, std::string> tree(const fs::path& root) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), root).string()] = contents(entry.path());
    }
  }
  return files;
}

std::vector<std::vector<std::string>> rows(const fs::path& csv) {
  std::vector<std::vector<std::string>> result;
  std::istringstream in(contents(csv));
  for (std::string line; std::getline(in, line);) {
    if (line.front() == '#') continue;
    std::vector<std::string> fields;
    std::istringstream fields_in(line);
    for (std::string field; std::getline(fields_in, field, ',');) fields.push_back(field);
    result.push_back(fields);
  }
  return result;
}

class SimulateRecording : public testing::Test {
 protected:
  SimulateRecording()
      : root_(fs::path(testing::TempDir()) /
              (std::string("etalon_") +
               testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~SimulateRecording() override { fs::remove_all(root_); }

  /** Images a quarter of EuRoC's in either direction, to be quick. */
  SimulationOptions options(const std::string& folder) const {
    SimulationOptions o;
    o.output = (root_ / folder).string();
    o.duration_s = 0.2;
    for (CameraCalibration& camera : o.calibration.cameras) {
      const CameraModel& m = camera.model;
      std::vector<double> intrinsics = m.intrinsics();
      for (double& x : intrinsics) x /= 4.0;
      camera.model = CameraModel("pinhole", "radial-tangential", m.width() / 4, m.height() / 4,
                                 intrinsics, m.coefficients());
    }
    return o;
  }
  std::string write(const std::string& name, const std::string& text) const {
    const fs::path path = root_ / name;
    std::ofstream(path) << text;
    return path.string();
  }
  static std::string messageOf(const SimulationOptions& options) {
    try {
      simulateRecording(options);
    } catch (const DataError& e) {
      return e.what();
    }
    return "no DataError";
  }

  fs::path root_;
};

TEST_F(SimulateRecording, WritesAnEurocFolder) {
  const SimulationOptions o = options("a");
  const SimulationSummary summary = simulateRecording(o);
  EXPECT_EQ(summary.stereo_frames, 4);
  const fs::path mav0 = root_ / "a" / "mav0";
  for (const char* camera : {"cam0", "cam1"}) {
    const auto images = rows(mav0 / camera / "data.csv");
    ASSERT_EQ(images.size(), 4u);
    EXPECT_EQ(std::stoll(images[1][0]) - std::stoll(images[0][0]), 50'000'000);
    for (const auto& row : images) {
      EXPECT_EQ(row[1], row[0] + ".png");
      const cv::Mat image =
          cv::imread((mav0 / camera / "data" / row[1]).string(), cv::IMREAD_UNCHANGED);
      EXPECT_EQ(image.type(), CV_8UC1);
      EXPECT_EQ(image.size(), cv::Size(188, 120));
    }
    EXPECT_THAT(contents(mav0 / camera / "sensor.yaml"), HasSubstr("radial-tangential"));
  }
  const auto imu = rows(mav0 / "imu0" / "data.csv");
  EXPECT_EQ(static_cast<int>(imu.size()), summary.imu_samples);
  EXPECT_EQ(imu.front().size(), 7u);
  EXPECT_THAT(contents(mav0 / "imu0" / "sensor.yaml"),
              HasSubstr("gyroscope_noise_density: 0.00016968"));
  const auto truth = rows(mav0 / "state_groundtruth_estimate0" / "data.csv");
  EXPECT_EQ(truth.size(), imu.size());
  EXPECT_EQ(truth.front().size(), 17u);
  // The IMU covers the images.
  const auto images = rows(mav0 / "cam0" / "data.csv");
  EXPECT_LE(std::stoll(imu.front()[0]), std::stoll(images.front()[0]) - 50'000'000);
  EXPECT_GE(std::stoll(imu.back()[0]), std::stoll(images.back()[0]));
}

TEST_F(SimulateRecording, SameSeedSameFilesWhateverTheThreads) {
  SimulationOptions o = options("one");
  o.threads = 1;
  simulateRecording(o);
  o.output = (root_ / "two").string();
  o.threads = 2;
  simulateRecording(o);
  EXPECT_EQ(tree(root_ / "one"), tree(root_ / "two"));
  o.output = (root_ / "other").string();
  o.seed = 2;
  simulateRecording(o);
  const auto first = tree(root_ / "one"), other = tree(root_ / "other");
  EXPECT_EQ(first.size(), other.size());
  for (const auto& [name, text] : first) {
    // The image lists carry stamps only.
    if (name != "mav0/cam0/data.csv" && name != "mav0/cam1/data.csv") {
      EXPECT_NE(text, other.at(name)) << name;
    }
  }
}

TEST_F(SimulateRecording, RefusesAFolderThatIsNotEmpty) {
  SimulationOptions o = options("a");
  fs::create_directories(root_ / "a" / "mav0" / "cam0");
  write("a/mine.txt", "keep");
  write("a/mav0/cam0/old.png", "stale");
  EXPECT_THROW(simulateRecording(o), ConfigError);
  EXPECT_FALSE(fs::exists(root_ / "a" / "mav0" / "imu0"));
  o.overwrite = true;
  simulateRecording(o);
  EXPECT_EQ(contents(root_ / "a" / "mine.txt"), "keep");
  EXPECT_FALSE(fs::exists(root_ / "a" / "mav0" / "cam0" / "old.png"));
}

TEST_F(SimulateRecording, RecordedFlightWithItsImuIsCopied) {
  SimulationOptions o = options("first");
  simulateRecording(o);
  const fs::path mav0 = root_ / "first" / "mav0";
  SimulationOptions again = options("again");
  again.trajectory_file = (mav0 / "state_groundtruth_estimate0" / "data.csv").string();
  again.imu_file = (mav0 / "imu0" / "data.csv").string();
  const std::string start = rows(mav0 / "cam0" / "data.csv").front()[0];
  again.stamps_file =
      write("stamps.txt", "100\n" + std::to_string(std::stoll(start) + 20'000'000) + "\n" +
                              std::to_string(std::stoll(start) + 70'000'001) + "\n");
  const SimulationSummary summary = simulateRecording(again);
  EXPECT_EQ(summary.stereo_frames, 2);
  EXPECT_EQ(summary.skipped_stamps, 1);  // the one before the flight
  const fs::path copy = root_ / "again" / "mav0";
  EXPECT_EQ(contents(copy / "imu0" / "data.csv"), contents(mav0 / "imu0" / "data.csv"));
  EXPECT_EQ(contents(copy / "state_groundtruth_estimate0" / "data.csv"),
            contents(mav0 / "state_groundtruth_estimate0" / "data.csv"));
}

TEST_F(SimulateRecording, RecordedFlightGetsASyntheticImu) {
  SimulationOptions o = options("first");
  o.duration_s = 0.6;
  simulateRecording(o);
  SimulationOptions again = options("again");
  again.trajectory_file =
      (root_ / "first" / "mav0" / "state_groundtruth_estimate0" / "data.csv").string();
  const SimulationSummary summary = simulateRecording(again);
  EXPECT_EQ(summary.stereo_frames, 4);
  const auto before = rows(again.trajectory_file);
  const auto after = rows(root_ / "again" / "mav0" / "state_groundtruth_estimate0" / "data.csv");
  ASSERT_EQ(before.size(), after.size());
  for (size_t k = 0; k < before.size(); ++k) {
    EXPECT_EQ(before[k][0], after[k][0]);
    for (size_t c : {1, 2, 3}) EXPECT_NEAR(std::stod(before[k][c]), std::stod(after[k][c]), 1e-6);
    for (size_t c = 11; c < 17; ++c) EXPECT_EQ(before[k][c], after[k][c]);  // biases
  }
}

TEST_F(SimulateRecording, BadFilesAreNamedWithTheirLine) {
  SimulationOptions o = options("a");
  const std::string good = "1,0,0,0,1,0,0,0\n";
  o.trajectory_file = (root_ / "missing.csv").string();
  EXPECT_THAT(messageOf(o), HasSubstr("missing.csv"));
  o.trajectory_file = write("columns.csv", "#stamp\n" + good + "2,0,0\n");
  EXPECT_THAT(messageOf(o), HasSubstr("columns.csv:3: found 3 columns"));
  o.trajectory_file = write("order.csv", good + good);
  EXPECT_THAT(messageOf(o), HasSubstr("order.csv:2"));
  o.trajectory_file = write("nan.csv", good + "2,0,nan,0,1,0,0,0\n");
  EXPECT_THAT(messageOf(o), HasSubstr("nan.csv:2: 'nan'"));
  o.trajectory_file = write("norm.csv", good + "2,0,0,0,1,1,0,0\n");
  EXPECT_THAT(messageOf(o), HasSubstr("norm.csv:2"));
  o.trajectory_file = write("jump.csv", good + "900000000000000000,0,0,0,1,0,0,0\n");
  EXPECT_THAT(messageOf(o),
              HasSubstr("jump.csv: the first and the last stamp are more than a day"));
  o.trajectory_file = write("future.csv", good + "9000000000000000000,0,0,0,1,0,0,0\n");
  EXPECT_THAT(messageOf(o), HasSubstr("future.csv:2: '9000000000000000000'"));
  o.trajectory_file = write("short.csv", good);
  EXPECT_THAT(messageOf(o), HasSubstr("short.csv: has 1 rows"));
  o.trajectory_file = write("flight.csv", good + "2000000000,0,0,0,1,0,0,0\n");
  o.imu_file = write("imu.csv", "1,0,0,0,0,0\n");
  EXPECT_THAT(messageOf(o), HasSubstr("imu.csv:1: found 6 columns"));
  o.imu_file = write("imu.csv", "1,0,0,0,9,0,0\n2000000000,0,0,0,9,0,0\n");
  o.stamps_file = write("stamps.txt", "5e9\n");
  EXPECT_THAT(messageOf(o), HasSubstr("stamps.txt:1: '5e9'"));
  o.stamps_file = write("stamps.txt", "3000000000\n");
  EXPECT_THAT(messageOf(o), HasSubstr("stamps.txt: no image"));
  EXPECT_FALSE(fs::exists(root_ / "a"));
}

TEST_F(SimulateRecording, RefusesOptionsThatCannotBe) {
  SimulationOptions o = options("a");
  o.duration_s = 0.0;
  EXPECT_THROW(simulateRecording(o), ConfigError);
  o = options("a");
  o.imu_file = "imu.csv";
  EXPECT_THROW(simulateRecording(o), ConfigError);
  o = options("");
  o.output.clear();
  EXPECT_THROW(simulateRecording(o), ConfigError);
  EXPECT_FALSE(fs::exists(root_ / "a"));
}

TEST_F(SimulateRecording, ReportsProgress) {
  SimulationOptions o = options("a");
  std::vector<int> done;
  o.progress = [&](int count, int all) {
    EXPECT_EQ(all, 4);
    done.push_back(count);
  };
  simulateRecording(o);
  EXPECT_EQ(done, (std::vector<int>{1, 2, 3, 4}));
}

}  // namespace
}  // namespace etalon
