#pragma once

#include "etalon/odometry/fixed_lag/odometry.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/** The state of the attempt's `k`-th keyframe, in the odometry's world (see odometryStart()). */
NavState stateOf(const InitializationAttempt& attempt, size_t k, const SE3& T_WA);

/**
 * Where an odometry begins after an accepted attempt: the state of its last keyframe.
 * @param T_WA from the attempt's world to the odometry's; a turn about z and a shift
 * The covariance is that of the VI-BA or, without one, of the initializer's result; where neither
 * has one, it is that of a rough start (2 deg, 0.1 m/s, 0.01 rad/s, 0.1 m/s^2).
 */
OdometryStart odometryStart(const InitializationAttempt& attempt, const SE3& T_WA);

}  // namespace etalon
