#pragma once

#include "etalon/imu/imu_sample.h"

namespace etalon {

/** No gyro and no accelerometer of a moving platform measures more: 5,700 deg/s, 100 g. */
constexpr double kMostGyroRps = 100.0;
constexpr double kMostAccelMps2 = 1000.0;

/** Whether all six numbers are finite and no larger than that. */
inline bool isMeasurement(const ImuSample& sample, double most_gyro_rps = kMostGyroRps,
                          double most_accel_mps2 = kMostAccelMps2) {
  return sample.gyro.allFinite() && sample.accel.allFinite() &&
         sample.gyro.cwiseAbs().maxCoeff() <= most_gyro_rps &&
         sample.accel.cwiseAbs().maxCoeff() <= most_accel_mps2;
}

}  // namespace etalon
