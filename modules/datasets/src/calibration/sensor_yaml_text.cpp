#include "etalon/datasets/sensor_yaml_text.h"

#include <Eigen/Core>
#include <array>
#include <charconv>

#include "etalon/core/text.h"

namespace etalon {
namespace {

std::string shortest(double x) {
  std::array<char, 32> text;
  const auto result = std::to_chars(text.data(), text.data() + text.size(), x);
  return {text.data(), result.ptr};
}

}  // namespace

std::string shortestNumbers(const std::vector<double>& numbers, const char* separator) {
  std::string text;
  for (double x : numbers) text += (text.empty() ? "" : separator) + shortest(x);
  return text;
}

/** A double-quoted scalar: a path may hold what YAML reads otherwise. */
static std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string poseYaml(const std::string& type, const std::string& comment, const SE3& T_BS) {
  const Eigen::Matrix4d T = T_BS.matrix();
  std::string text =
      "# General sensor definitions.\nsensor_type: " + type + "\ncomment: " + quoted(comment) +
      "\n\n# Sensor extrinsics wrt. the body-frame.\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int i = 0; i < 4; ++i) {
    text += shortestNumbers({T(i, 0), T(i, 1), T(i, 2), T(i, 3)}, ", ") +
            (i < 3 ? ",\n         " : "]\n");
  }
  return text;
}

std::string cameraYaml(const CameraCalibration& camera, const std::string& comment) {
  const CameraModel& m = camera.model;
  return poseYaml("camera", comment, camera.T_BC) +
         "\n# Camera specific definitions.\nrate_hz: " + shortest(camera.rate_hz) +
         "\nresolution: [" + std::to_string(m.width()) + ", " + std::to_string(m.height()) +
         "]\ncamera_model: " + m.kind()->camera_model + "\nintrinsics: [" +
         shortestNumbers(m.intrinsics(), ", ") + "] # " + joined(m.kind()->intrinsics) +
         "\ndistortion_model: " + m.kind()->distortion.front() + "\ndistortion_coefficients: [" +
         shortestNumbers(m.coefficients(), ", ") + "]\n";
}

std::string imuYaml(const ImuCalibration& imu, const std::string& comment) {
  return poseYaml("imu", comment, SE3()) + "rate_hz: " + shortest(imu.rate_hz) +
         "\n\n# inertial sensor noise model parameters (static)\ngyroscope_noise_density: " +
         shortest(imu.noise.gyro_noise_density) +
         "     # [ rad / s / sqrt(Hz) ]\ngyroscope_random_walk: " +
         shortest(imu.noise.gyro_random_walk) +
         "       # [ rad / s^2 / sqrt(Hz) ]\naccelerometer_noise_density: " +
         shortest(imu.noise.accel_noise_density) +
         "  # [ m / s^2 / sqrt(Hz) ]\naccelerometer_random_walk: " +
         shortest(imu.noise.accel_random_walk) + "    # [ m / s^3 / sqrt(Hz) ]\n";
}

}  // namespace etalon
