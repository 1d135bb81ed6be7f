#pragma once

// Intervals that the IMU does not cover. Private to the module.

#include <vector>

#include "etalon/optimization/residuals/inertial_residual.h"

namespace etalon {

/** Whether the samples of an IMU of that nominal rate (longestImuStep()) reach from t0 to t1 without a
 * gap. */
bool isComplete(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1, double rate_hz);

/** The longest time between t0 and t1 without a sample, s; all of it where they do not reach that far.
 */
double longestGap(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1);

/**
 * Takes the place of an IMU that is missing or has gaps: the samples that there are, and elsewhere
 * a body that keeps its velocity and attitude, with noise as large as the rates (0.5 rad/s) and
 * accelerations (2 m/s^2) of a flight, correlated over the gap.
 * @param from the state at t0
 */
Preintegration bridgedImu(const NavState& from, TimeNs t0, TimeNs t1, std::vector<ImuSample> imu,
                          ImuNoiseDensities noise, const Eigen::Vector3d& g_W);

}  // namespace etalon
