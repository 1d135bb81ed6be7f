#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "etalon/core/nav_state.h"
#include "etalon/core/time.h"

namespace etalon {

/** One IMU measurement, in the body frame B. */
struct ImuSample {
  TimeNs t = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, m/s^2
  std::uint8_t saturated = 0;  ///< axes at the end of their range; SaturationDetector marks them
};

/** Bits of ImuSample::saturated for an axis, 0 to 2. */
constexpr std::uint8_t saturatedGyro(int axis) { return static_cast<std::uint8_t>(1U << axis); }
constexpr std::uint8_t saturatedAccel(int axis) { return static_cast<std::uint8_t>(8U << axis); }

}  // namespace etalon
