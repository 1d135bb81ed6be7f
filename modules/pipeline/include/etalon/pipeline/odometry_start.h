#pragma once

#include "etalon/odometry/odometry.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/**
 * Where an odometry begins after an accepted attempt: the state of the window's first keyframe. The
 * odometry is to be given the window's frames from there on, so that the attempt counts for its
 * value alone: the covariance is wide (0.03 rad of tilt, 0.1 m/s, 0.02 rad/s), and no measurement
 * is used twice. The biases are known no worse than before any measurement.
 * @param T_WA from the attempt's world to the odometry's; a turn about z and a shift
 * @param priors of the biases before any measurement
 */
OdometryStart odometryStart(const InitializationAttempt& attempt, const SE3& T_WA,
                            const BiasPriors& priors);

/**
 * Moves the start from the instant of the first image to that of its stamp, with constant rate and
 * acceleration.
 * @param offset_s by which the image is later, in the IMU's time, than its stamp
 * @param imu samples between the two instants, at least one
 */
void moveToStamp(double offset_s, const std::vector<ImuSample>& imu, double gravity_mps2,
                 OdometryStart* start);

}  // namespace etalon
