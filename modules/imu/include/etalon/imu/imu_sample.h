#pragma once

#include <Eigen/Core>

#include "etalon/core/nav_state.h"
#include "etalon/core/time.h"

namespace etalon {

/** One IMU measurement, in the body frame B. */
struct ImuSample {
  TimeNs t = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, m/s^2
};

}  // namespace etalon
