#include "calibration/kalibr_text.h"

#include <algorithm>

#include "etalon/datasets/sensor_yaml_text.h"

namespace etalon {

namespace {

/** A list of numbers as YAML has it. */
std::string listOf(const std::vector<double>& numbers) {
  return "[" + shortestNumbers(numbers, ", ") + "]";
}

std::string transform(const SE3& T) {
  const Eigen::Matrix4d M = T.matrix();
  std::string text;
  for (int r = 0; r < 4; ++r)
    text += "    - " + listOf({M(r, 0), M(r, 1), M(r, 2), M(r, 3)}) + "\n";
  return text;
}

/** Kalibr's name of the distortion. */
std::string distortionOf(const CameraModel& model) {
  const std::vector<std::string>& names = model.kind()->distortion;
  return std::find(names.begin(), names.end(), "radtan") == names.end() ? names.front() : "radtan";
}

}  // namespace

std::string camchainText(const StereoInertialCalibration& calibration,
                         const std::array<std::string, 2>& topics) {
  std::string text;
  for (size_t c = 0; c < 2; ++c) {
    const CameraCalibration& camera = calibration.cameras[c];
    text += "cam" + std::to_string(c) + ":\n  T_cam_imu:\n" + transform(camera.T_BC.inverse());
    if (c == 1) text += "  T_cn_cnm1:\n" + transform(calibration.rightFromLeft());
    text += "  camera_model: " + camera.model.kind()->camera_model + "\n";
    text += "  distortion_coeffs: " + listOf(camera.model.coefficients()) + "\n";
    text += "  distortion_model: " + distortionOf(camera.model) + "\n";
    text += "  intrinsics: " + listOf(camera.model.intrinsics()) + "\n";
    text += "  resolution: [" + std::to_string(camera.model.width()) + ", " +
            std::to_string(camera.model.height()) + "]\n";
    text += "  rostopic: " + topics[c] + "\n  timeshift_cam_imu: 0.0\n";
  }
  return text;
}

std::string kalibrImuText(const ImuCalibration& imu, const std::string& topic) {
  const ImuNoiseDensities& noise = imu.noise;
  const auto line = [](const char* key, double value) {
    return std::string(key) + ": " + shortestNumbers({value}) + "\n";
  };
  return line("accelerometer_noise_density", noise.accel_noise_density) +
         line("accelerometer_random_walk", noise.accel_random_walk) +
         line("gyroscope_noise_density", noise.gyro_noise_density) +
         line("gyroscope_random_walk", noise.gyro_random_walk) + "rostopic: " + topic + "\n" +
         line("update_rate", imu.rate_hz);
}

}  // namespace etalon
