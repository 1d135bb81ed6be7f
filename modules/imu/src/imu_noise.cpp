#include "etalon/imu/imu_noise.h"

namespace etalon {

void ImuNoiseOptions::declare(ParameterSet& parameters) {
  parameters.add("gyro_noise_factor", &gyro_noise_factor, {0.1, 1000.0},
                 "The gyro's white-noise density is the data sheet's times this factor.");
  parameters.add("accel_noise_factor", &accel_noise_factor, {0.1, 1000.0},
                 "The accelerometer's white-noise density is the data sheet's times this factor "
                 "(vibration of a flying platform).");
}

ImuNoiseDensities ImuNoiseOptions::apply(const ImuNoiseDensities& data_sheet) const {
  ImuNoiseDensities used = data_sheet;
  used.gyro_noise_density *= gyro_noise_factor;
  used.accel_noise_density *= accel_noise_factor;
  return used;
}

}  // namespace etalon
