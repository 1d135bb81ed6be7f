#pragma once

#include <array>
#include <string>

#include "etalon/core/calibration.h"

namespace etalon {

/** Kalibr's camchain.yaml of both cameras. */
std::string camchainText(const StereoInertialCalibration& calibration,
                         const std::array<std::string, 2>& topics);

/** Kalibr's imu.yaml. */
std::string kalibrImuText(const ImuCalibration& imu, const std::string& topic);

}  // namespace etalon
