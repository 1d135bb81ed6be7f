#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"

namespace etalon {

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

}  // namespace etalon
