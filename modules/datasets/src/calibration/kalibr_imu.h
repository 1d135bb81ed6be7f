#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"

namespace etalon {

/** An IMU as Kalibr's imu.yaml has it. */
struct KalibrImu {
  ImuNoiseDensities noise;
  std::optional<double> rate_hz;
  std::string topic;  ///< `rostopic`; empty if it has none
  std::vector<std::string> warnings;
};

/**
 * Reads Kalibr's imu.yaml, of before a calibration (keys at the top) or after it (below `imu0`):
 * accelerometer_noise_density, accelerometer_random_walk, gyroscope_noise_density,
 * gyroscope_random_walk, update_rate and rostopic where there are such.
 * @throws DataError naming file, line, key and what was expected
 */
KalibrImu readKalibrImu(const std::string& path);

}  // namespace etalon
