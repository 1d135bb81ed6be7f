#pragma once

#include <string>
#include <vector>

#include "etalon/core/calibration.h"

namespace etalon {

/** Numbers with the fewest digits that read back as the same double. */
std::string shortestNumbers(const std::vector<double>& numbers, const char* separator = ",");

/** `sensor.yaml` of a sensor without numbers of its own. @param type of the sensor */
std::string poseYaml(const std::string& type, const std::string& comment, const SE3& T_BS);
/** `sensor.yaml` of a camera (docs/cameras.md). */
std::string cameraYaml(const CameraCalibration& camera, const std::string& comment);
/** `sensor.yaml` of an IMU, which is the body. */
std::string imuYaml(const ImuCalibration& imu, const std::string& comment);

}  // namespace etalon
