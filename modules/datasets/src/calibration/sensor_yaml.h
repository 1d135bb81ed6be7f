#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"

namespace etalon {

class YamlMap;

/** A camera's `sensor.yaml`. */
struct CameraYaml {
  CameraModel model;
  SE3 T_BS;                       ///< sensor to the rig's body frame, as the file gives it
  std::optional<double> rate_hz;  ///< where the file gives one
  std::vector<std::string> warnings;
};

/** An IMU's `sensor.yaml`. */
struct ImuYaml {
  ImuNoiseDensities noise;
  SE3 T_BS;
  std::optional<double> rate_hz;
  std::vector<std::string> warnings;
};

// All throw DataError naming file, line and what was expected. Unknown fields are ignored; the form
// that starts with `%YAML:1.0` (OpenCV's) is accepted.
CameraYaml readCameraYaml(const std::string& path);
ImuYaml readImuYaml(const std::string& path);
/** `T_BS` alone, of a `sensor.yaml` of whatever sensor; the identity where the file has none. */
SE3 readPoseYaml(const std::string& path);

/** gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density and
 * accelerometer_random_walk. @throws DataError as above */
ImuNoiseDensities readNoiseDensities(const YamlMap& yaml);
/** A rate in Hz; nothing without the key. @throws DataError as above */
std::optional<double> readRate(const YamlMap& yaml, const std::string& key);

}  // namespace etalon
