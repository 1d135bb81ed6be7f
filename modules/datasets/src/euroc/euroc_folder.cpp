#include "etalon/datasets/euroc_folder.h"

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/datasets/sensor_yaml_text.h"

namespace etalon {

namespace fs = std::filesystem;

namespace {

constexpr std::array<const char*, 2> kCameraFolders = {"cam0", "cam1"};
constexpr char kImuFolder[] = "imu0";
constexpr char kTruthFolder[] = "state_groundtruth_estimate0";

std::string row(TimeNs t, const std::vector<Eigen::Vector3d>& vectors) {
  std::string text = std::to_string(t);
  for (const Eigen::Vector3d& v : vectors) text += "," + shortestNumbers({v.x(), v.y(), v.z()});
  return text + "\n";
}

void copyFile(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) throw DataError(to, 0, "cannot be copied from " + from + ": " + error.message());
}

}  // namespace

EurocFolder::EurocFolder(const std::string& path, bool overwrite, const std::string& advice) {
  std::error_code error;
  if (fs::exists(path, error)) {
    if (!fs::is_directory(path, error)) throw ConfigError(path + ": exists and is not a folder");
    const bool empty = fs::is_empty(path, error);
    if (error) throw DataError(path, 0, "cannot be read: " + error.message());
    if (!empty && !overwrite) {
      throw ConfigError(path + ": the folder is not empty; " + advice);
    }
  }
  output_ = std::make_unique<OutputFiles>((fs::path(path) / "mav0").string());
  for (const char* folder : kCameraFolders) makeFolder(sensor(folder) + "/data");
  for (const char* folder : {kImuFolder, kTruthFolder}) makeFolder(sensor(folder));
}

void EurocFolder::writeCalibration(const StereoInertialCalibration& calibration,
                                   const std::string& comment) const {
  for (size_t i = 0; i < 2; ++i) {
    writeFile(sensor(kCameraFolders[i]) + "/sensor.yaml",
              cameraYaml(calibration.cameras[i], comment));
  }
  writeFile(sensor(kImuFolder) + "/sensor.yaml", imuYaml(calibration.imu, comment));
  writeFile(sensor(kTruthFolder) + "/sensor.yaml", poseYaml("visual-inertial", comment, SE3()));
}

void EurocFolder::writeImu(const std::vector<ImuSample>& samples) const {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m "
      "s^-2],a_RS_S_y "
      "[m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& s : samples) text += row(s.t, {s.gyro, s.accel});
  writeFile(sensor(kImuFolder) + "/data.csv", text);
}

void EurocFolder::writeGroundTruth(const GroundTruth& truth) const {
  if (truth.has_velocity && truth.has_biases) return writeGroundTruth(truth.states);
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z []\n";
  for (const StampedState& s : truth.states) {
    const Eigen::Quaterniond q(s.T_WB.R);
    const Eigen::Vector3d& p = s.T_WB.t;
    text += std::to_string(s.t) + "," +
            shortestNumbers({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) + "\n";
  }
  writeFile(sensor(kTruthFolder) + "/data.csv", text);
}

void EurocFolder::writeGroundTruth(const std::vector<StampedState>& states) const {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x "
      "[m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad "
      "s^-1], b_w_RS_S_z "
      "[rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  for (const StampedState& s : states) {
    const Eigen::Quaterniond q(s.T_WB.R);
    const Eigen::Vector3d &p = s.T_WB.t, &v = s.v_WB, &g = s.bias.gyro, &a = s.bias.accel;
    text += std::to_string(s.t) + "," +
            shortestNumbers({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z(),
                             g.x(), g.y(), g.z(), a.x(), a.y(), a.z()}) +
            "\n";
  }
  writeFile(sensor(kTruthFolder) + "/data.csv", text);
}

void EurocFolder::copyImu(const std::string& file) const {
  copyFile(file, sensor(kImuFolder) + "/data.csv");
}

void EurocFolder::copyGroundTruth(const std::string& file) const {
  copyFile(file, sensor(kTruthFolder) + "/data.csv");
}

void EurocFolder::writeImageLists(const std::vector<TimeNs>& stamps) const {
  std::string text = "#timestamp [ns],filename\n";
  for (TimeNs t : stamps) text += std::to_string(t) + "," + std::to_string(t) + ".png\n";
  for (const char* camera : kCameraFolders) writeFile(sensor(camera) + "/data.csv", text);
}

void EurocFolder::writeImage(size_t camera, TimeNs t, const cv::Mat& image) const {
  const std::string path =
      sensor(kCameraFolders.at(camera)) + "/data/" + std::to_string(t) + ".png";
  std::vector<unsigned char> png;
  // Uncompressed, as EuRoC's own images are: noisy ones hardly get smaller, and are read twice as fast.
  cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 0});
  writeFile(path, std::string(png.begin(), png.end()));
}

}  // namespace etalon
