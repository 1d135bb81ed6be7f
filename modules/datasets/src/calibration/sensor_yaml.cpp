#include "calibration/sensor_yaml.h"

#include "calibration/yaml_map.h"

namespace etalon {

namespace {

SE3 readPose(const YamlMap& yaml, std::vector<std::string>* warnings) {
  return yaml.transform("T_BS", "a 4x4 transform (16 numbers, row by row), sensor to body",
                        warnings);
}

double readDensity(const YamlMap& yaml, const std::string& key, const std::string& unit) {
  const std::string expected = "a continuous-time noise density in " + unit;
  const double value = yaml.number(key, expected);
  if (value < 0) yaml.fail(yaml.node(key, expected), "expected '" + key + "' not to be negative");
  return value;
}

}  // namespace

std::optional<double> readRate(const YamlMap& yaml, const std::string& key) {
  if (!yaml.has(key)) return std::nullopt;
  const double rate = yaml.number(key, "a rate in Hz");
  if (rate <= 0) yaml.fail(yaml.node(key, ""), "expected '" + key + "' to be positive");
  return rate;
}

ImuNoiseDensities readNoiseDensities(const YamlMap& yaml) {
  ImuNoiseDensities noise;
  noise.gyro_noise_density = readDensity(yaml, "gyroscope_noise_density", "rad/s/sqrt(Hz)");
  noise.gyro_random_walk = readDensity(yaml, "gyroscope_random_walk", "rad/s^2/sqrt(Hz)");
  noise.accel_noise_density = readDensity(yaml, "accelerometer_noise_density", "m/s^2/sqrt(Hz)");
  noise.accel_random_walk = readDensity(yaml, "accelerometer_random_walk", "m/s^3/sqrt(Hz)");
  return noise;
}

CameraYaml readCameraYaml(const std::string& path) {
  const YamlMap yaml(path);
  CameraYaml camera;
  camera.model = readCameraModel(yaml, "distortion_coefficients");
  camera.T_BS = readPose(yaml, &camera.warnings);
  camera.rate_hz = readRate(yaml, "rate_hz");
  return camera;
}

ImuYaml readImuYaml(const std::string& path) {
  const YamlMap yaml(path);
  ImuYaml imu;
  imu.noise = readNoiseDensities(yaml);
  imu.T_BS = readPose(yaml, &imu.warnings);
  imu.rate_hz = readRate(yaml, "rate_hz");
  return imu;
}

SE3 readPoseYaml(const std::string& path) {
  const YamlMap yaml(path);
  return yaml.has("T_BS") ? readPose(yaml, nullptr) : SE3();
}

}  // namespace etalon
