#include "euroc_folder.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {

namespace {

using Row = std::vector<std::string>;

std::vector<Row> readCsv(const std::string& path, size_t columns) {
  std::ifstream file(path);
  if (!file) throw DataError(path, 0, "cannot be opened");
  std::vector<Row> rows;
  std::string line, cell;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    std::istringstream stream(line);
    Row row;
    while (std::getline(stream, cell, ',')) row.push_back(cell);
    if (row.size() < columns)
      throw DataError(path, number, "expected " + std::to_string(columns) + " columns");
    if (row.back().back() == '\r') row.back().pop_back();
    rows.push_back(row);
  }
  return rows;
}

Eigen::Vector3d vectorAt(const Row& row, size_t i) {
  return {std::stod(row[i]), std::stod(row[i + 1]), std::stod(row[i + 2])};
}

CameraCalibration readCamera(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw DataError(path, 0, "cannot be opened");
  std::string text, line;
  while (std::getline(file, line))
    if (line.rfind("%YAML", 0) != 0) text += line + "\n";  // OpenCV's form of the directive
  const YAML::Node node = YAML::Load(text);
  CameraCalibration camera;
  const auto T = node["T_BS"]["data"].as<std::vector<double>>();
  const auto k = node["intrinsics"].as<std::vector<double>>();
  const auto d = node["distortion_coefficients"].as<std::vector<double>>();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      camera.T_BC.R(r, c) = T.at(4 * static_cast<size_t>(r) + static_cast<size_t>(c));
    camera.T_BC.t[r] = T.at(4 * static_cast<size_t>(r) + 3);
  }
  camera.T_BC.R = nearestRotation(camera.T_BC.R);
  camera.model = CameraModel(
      node["camera_model"].as<std::string>(), node["distortion_model"].as<std::string>(),
      node["resolution"][0].as<int>(), node["resolution"][1].as<int>(), k, d);
  return camera;
}

}  // namespace

EurocFolder EurocFolder::read(const std::string& folder) {
  EurocFolder result;
  const std::string mav = folder + "/mav0/";
  std::map<TimeNs, std::string> right;
  for (size_t i = 0; i < 2; ++i) {
    const std::string camera = mav + "cam" + std::to_string(i) + "/";
    result.calibration.cameras[i] = readCamera(camera + "sensor.yaml");
    for (const Row& row : readCsv(camera + "data.csv", 2)) {
      const TimeNs t = std::stoll(row[0]);
      const std::string path = camera + "data/" + row[1];
      if (i == 0)
        result.pairs.push_back({t, path, ""});
      else
        right[t] = path;
    }
  }
  std::vector<Pair> paired;
  for (Pair& pair : result.pairs) {
    const auto found = right.find(pair.t);
    if (found != right.end()) paired.push_back({pair.t, pair.left_path, found->second});
  }
  result.pairs.swap(paired);
  for (const Row& row : readCsv(mav + "imu0/data.csv", 4))
    result.gyro.push_back({std::stoll(row[0]), vectorAt(row, 1)});
  for (const Row& row : readCsv(mav + "state_groundtruth_estimate0/data.csv", 17)) {
    GroundTruthState state;
    state.t = std::stoll(row[0]);
    const Eigen::Quaterniond q(std::stod(row[4]), std::stod(row[5]), std::stod(row[6]),
                               std::stod(row[7]));
    state.T_WB = SE3(q.normalized().toRotationMatrix(), vectorAt(row, 1));
    state.v_WB = vectorAt(row, 8);
    state.b_g = vectorAt(row, 11);
    state.b_a = vectorAt(row, 14);
    result.ground_truth.states.push_back(state);
  }
  result.ground_truth.has_velocity = result.ground_truth.has_biases = true;
  return result;
}

Eigen::Matrix3d EurocFolder::rotation(TimeNs from, TimeNs to, const Eigen::Vector3d& bias) const {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  auto next = std::upper_bound(gyro.begin(), gyro.end(), from,
                               [](TimeNs t, const Gyro& sample) { return t < sample.t; });
  for (TimeNs t = from; t < to && next != gyro.begin() && next != gyro.end(); ++next) {
    const TimeNs end = std::min(to, next->t);
    const Eigen::Vector3d rate = 0.5 * ((next - 1)->rate + next->rate) - bias;
    R = R * expSO3(rate * secondsBetween(t, end));
    t = end;
  }
  return R;
}

}  // namespace etalon
