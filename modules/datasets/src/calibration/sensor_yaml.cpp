#include "calibration/sensor_yaml.h"

#include "calibration/yaml_map.h"

namespace etalon {

namespace {

SE3 readPose(const YamlMap& yaml, std::vector<std::string>* warnings) {
  return yaml.transform("T_BS", "a 4x4 transform (16 numbers, row by row), sensor to body",
                        warnings);
}

std::optional<double> readRate(const YamlMap& yaml) {
  if (!yaml.has("rate_hz")) return std::nullopt;
  const double rate = yaml.number("rate_hz", "a rate in Hz");
  if (rate <= 0) yaml.fail(yaml.node("rate_hz", ""), "expected 'rate_hz' to be positive");
  return rate;
}

double readDensity(const YamlMap& yaml, const std::string& key, const std::string& unit) {
  const std::string expected = "a continuous-time noise density in " + unit;
  const double value = yaml.number(key, expected);
  if (value < 0) yaml.fail(yaml.node(key, expected), "expected '" + key + "' not to be negative");
  return value;
}

}  // namespace

CameraYaml readCameraYaml(const std::string& path) {
  const YamlMap yaml(path);
  CameraYaml camera;
  camera.model = readCameraModel(yaml, "distortion_coefficients");
  camera.T_BS = readPose(yaml, &camera.warnings);
  camera.rate_hz = readRate(yaml);
  return camera;
}

ImuYaml readImuYaml(const std::string& path) {
  const YamlMap yaml(path);
  ImuYaml imu;
  imu.noise.gyro_noise_density = readDensity(yaml, "gyroscope_noise_density", "rad/s/sqrt(Hz)");
  imu.noise.gyro_random_walk = readDensity(yaml, "gyroscope_random_walk", "rad/s^2/sqrt(Hz)");
  imu.noise.accel_noise_density =
      readDensity(yaml, "accelerometer_noise_density", "m/s^2/sqrt(Hz)");
  imu.noise.accel_random_walk = readDensity(yaml, "accelerometer_random_walk", "m/s^3/sqrt(Hz)");
  imu.T_BS = readPose(yaml, &imu.warnings);
  imu.rate_hz = readRate(yaml);
  return imu;
}

SE3 readPoseYaml(const std::string& path) {
  const YamlMap yaml(path);
  return yaml.has("T_BS") ? readPose(yaml, nullptr) : SE3();
}

}  // namespace etalon
