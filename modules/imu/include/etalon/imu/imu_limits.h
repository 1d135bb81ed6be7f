#pragma once

#include <algorithm>

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

/** A longer step between two samples is a gap, s: two samples in a row are missing, or 30 ms of a
 * faster IMU. @param rate_hz nominal, of the calibration; not positive: unknown */
inline double longestImuStep(double rate_hz) {
  constexpr double kLeastS = 0.03, kIntervals = 2.5;
  return rate_hz > 0.0 ? std::max(kLeastS, kIntervals / rate_hz) : kLeastS;
}

}  // namespace etalon
