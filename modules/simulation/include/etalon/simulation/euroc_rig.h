#pragma once

#include "etalon/core/calibration.h"

namespace etalon {

/**
 * EuRoC's rig: the calibration of both cameras (752x480, radial-tangential, 11 cm apart) and the
 * noise of the IMU (ADIS16448), as the data set's sensor.yaml files give them (Burri et al., IJRR
 * 2016).
 */
StereoInertialCalibration eurocCalibration();

}  // namespace etalon
