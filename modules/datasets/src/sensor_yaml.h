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
// that starts with
// `%YAML:1.0` (OpenCV's) is accepted.
CameraYaml readCameraYaml(const std::string& path);
ImuYaml readImuYaml(const std::string& path);
/** `T_BS` alone, of a `sensor.yaml` of whatever sensor; the identity where the file has none. */
SE3 readPoseYaml(const std::string& path);

/**
 * The rotation nearest to R. Rounding in the printed digits is repaired, with a warning from 1e-4
 * on; DataError if R^T R is off the identity by more than 0.01 or if det R < 0.
 */
Eigen::Matrix3d checkedRotation(const Eigen::Matrix3d& R, const std::string& file, int line,
                                const std::string& what, std::vector<std::string>* warnings);

}  // namespace etalon
