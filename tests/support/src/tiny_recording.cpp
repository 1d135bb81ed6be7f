#include "etalon/testing/tiny_recording.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "etalon/core/errors.h"

namespace etalon::testing {

namespace fs = std::filesystem;

namespace {

cv::Mat tinyImage(int seed) {
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  cv::RNG rng(static_cast<uint64_t>(seed) + 1);
  rng.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

std::string cameraYaml(double y) {
  std::ostringstream yaml;
  yaml << "# camera\n"
          "sensor_type: camera\n"
          "an_unknown_field: [1, two]\n"
          "T_BS:\n  cols: 4\n  rows: 4\n"
          "  data: [0.0, -1.0, 0.0, -0.02,\n"
          "         1.0, 0.0, 0.0, "
       << y
       << ",\n"
          "         0.0, 0.0, 1.0, 0.01,\n"
          "         0.0, 0.0, 0.0, 1.0]\n"
          "rate_hz: 20\n"
          "resolution: [64, 48]\n"
          "camera_model: pinhole\n"
          "intrinsics: [45.5, 45.25, 31.5, 23.5] #fu, fv, cu, cv\n"
          "distortion_model: radial-tangential\n"
          "distortion_coefficients: [-0.28, 0.07, 2e-4, 1.7e-05]\n";
  return yaml.str();
}

const char* const kImuYaml =
    "sensor_type: imu\n"
    "T_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n"
    "rate_hz: 200\n"
    "gyroscope_noise_density: 1.6968e-04\n"
    "gyroscope_random_walk: 1.9393e-05\n"
    "accelerometer_noise_density: 2.0000e-3\n"
    "accelerometer_random_walk: 3.0000e-3\n";

void writeCamera(const fs::path& folder, int index) {
  fs::create_directories(folder / "data");
  writeText(folder / "sensor.yaml", cameraYaml(index == 0 ? -0.05 : 0.06));
  std::ostringstream csv;
  csv << "#timestamp [ns],filename\n";
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = std::to_string(frameStamp(i)) + ".png";
    csv << frameStamp(i) << "," << name << "\n";
    cv::imwrite((folder / "data" / name).string(), tinyImage(10 * i + index));
  }
  writeText(folder / "data.csv", csv.str());
}

}  // namespace

void writeTinyRecording(const fs::path& folder) {
  const fs::path root = folder / "mav0";
  writeCamera(root / "cam0", 0);
  writeCamera(root / "cam1", 1);
  fs::create_directories(root / "imu0");
  writeText(root / "imu0/sensor.yaml", kImuYaml);
  std::ostringstream imu, truth;
  imu.precision(17), truth.precision(17);
  imu << "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n";
  for (int i = -20; i <= 10 * (kFrames - 1) + 20; ++i)
    imu << kFirstStamp + 5'000'000LL * i + i % 7 << "," << 0.01 * i << "," << -0.02 + 1e-3 * i
        << "," << 0.3 << "," << 0.1 * i / 3.0 << ",0.2," << 9.8 + 1e-4 * i << "\n";
  writeText(root / "imu0/data.csv", imu.str());
  fs::create_directories(root / "state_groundtruth_estimate0");
  truth << "#timestamp, p, q (w x y z), v, b_g, b_a\n";
  for (int i = -5; i <= 5 * (kFrames - 1) + 5; ++i) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(1, 0.01 * i, 0.2, -0.3 + 0.02 * i).normalized();
    truth << kFirstStamp + 10'000'000LL * i + 3 * (i + 5) << "," << 0.1 * i << "," << 1.5 << ","
          << -0.3 * i << "," << q.w() << "," << q.x() << "," << q.y() << "," << q.z() << ","
          << 0.01 * i << ",0.5,-0.25,0.001," << 0.002 + 1e-6 * i << ",0.003,0.1,0.2,"
          << 0.3 + 1e-5 * i << "\n";
  }
  writeText(root / "state_groundtruth_estimate0/data.csv", truth.str());
}

std::string readText(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void writeText(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

void replaceInFile(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = readText(file);
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from << " in " << file;
  writeText(file, text.replace(at, from.size(), to));
}

void replaceLine(const fs::path& file, int number, const std::string& line) {
  std::istringstream in(readText(file));
  std::ostringstream out;
  std::string old;
  for (int i = 1; std::getline(in, old); ++i) out << (i == number ? line : old) << "\n";
  writeText(file, out.str());
}

std::vector<SensorEvent> readAll(SensorSource& source) {
  std::vector<SensorEvent> events;
  while (auto event = source.next()) events.push_back(*event);
  return events;
}

std::vector<StereoFrame> framesOf(const std::vector<SensorEvent>& events) {
  std::vector<StereoFrame> frames;
  for (const SensorEvent& event : events)
    if (const auto* frame = std::get_if<StereoFrame>(&event)) frames.push_back(*frame);
  return frames;
}

std::vector<ImuSample> imuOf(const std::vector<SensorEvent>& events) {
  std::vector<ImuSample> samples;
  for (const SensorEvent& event : events)
    if (const auto* sample = std::get_if<ImuSample>(&event)) samples.push_back(*sample);
  return samples;
}

std::string dataErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const DataError& e) {
    return e.what();
  }
  return {};
}

namespace {

void expectSameCalibration(const StereoInertialCalibration& a, const StereoInertialCalibration& b) {
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(a.cameras[c].T_BC.matrix(), b.cameras[c].T_BC.matrix());
    EXPECT_EQ(a.cameras[c].rate_hz, b.cameras[c].rate_hz);
    EXPECT_TRUE(a.cameras[c].model == b.cameras[c].model);
  }
  const ImuNoiseDensities &m = a.imu.noise, &n = b.imu.noise;
  EXPECT_EQ((std::vector{m.gyro_noise_density, m.gyro_random_walk, m.accel_noise_density,
                         m.accel_random_walk, a.imu.rate_hz}),
            (std::vector{n.gyro_noise_density, n.gyro_random_walk, n.accel_noise_density,
                         n.accel_random_walk, b.imu.rate_hz}));
}

void expectSameGroundTruth(const GroundTruth& a, const GroundTruth& b) {
  EXPECT_EQ(a.has_velocity, b.has_velocity);
  EXPECT_EQ(a.has_biases, b.has_biases);
  ASSERT_EQ(a.states.size(), b.states.size());
  for (size_t i = 0; i < a.states.size(); ++i) {
    const StampedState &s = a.states[i], &t = b.states[i];
    ASSERT_EQ(s.t, t.t);
    EXPECT_EQ(s.T_WB.t, t.T_WB.t);
    // The rotation passes through MRPT's quaternion: a few roundings.
    EXPECT_LT((s.T_WB.R - t.T_WB.R).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_EQ(s.v_WB, t.v_WB);
    EXPECT_EQ(s.bias.gyro, t.bias.gyro);
    EXPECT_EQ(s.bias.accel, t.bias.accel);
  }
}

void expectSameEvent(const SensorEvent& a, const SensorEvent& b) {
  ASSERT_EQ(a.index(), b.index());
  ASSERT_EQ(stampOf(a), stampOf(b));
  if (const auto* sample = std::get_if<ImuSample>(&a)) {
    EXPECT_EQ(sample->gyro, std::get<ImuSample>(b).gyro);
    EXPECT_EQ(sample->accel, std::get<ImuSample>(b).accel);
    return;
  }
  const auto &f = std::get<StereoFrame>(a), &g = std::get<StereoFrame>(b);
  ASSERT_EQ(f.left.size(), g.left.size());
  EXPECT_EQ(cv::norm(f.left, g.left, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(f.right, g.right, cv::NORM_INF), 0);
}

}  // namespace

void expectSameRecording(SensorSource& a, SensorSource& b) {
  expectSameCalibration(a.calibration(), b.calibration());
  expectSameGroundTruth(a.groundTruth(), b.groundTruth());
  EXPECT_EQ(a.imageStamps(), b.imageStamps());
  for (;;) {
    const auto event = a.next(), other = b.next();
    ASSERT_EQ(event.has_value(), other.has_value());
    if (!event) break;
    ASSERT_NO_FATAL_FAILURE(expectSameEvent(*event, *other));
  }
}

}  // namespace etalon::testing
