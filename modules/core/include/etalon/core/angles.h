#pragma once

#include <Eigen/Core>
#include <cmath>

namespace etalon {

constexpr double kDegreesPerRadian = 180.0 / M_PI;

constexpr double degrees(double radians) { return radians * kDegreesPerRadian; }
constexpr double radians(double degrees) { return degrees * (M_PI / 180.0); }

/**
 * The turn about z that aligns best: the angle in rad, within +-pi, that makes trace(Rz(angle)^T M)
 * greatest, which is cos(angle) (m00 + m11) + sin(angle) (m10 - m01) + m22. M = sum to_i from_i^T
 * for vectors that are to be aligned, R_to R_from^T for rotations.
 */
inline double aligningYaw(const Eigen::Matrix3d& M) {
  return std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1));
}

}  // namespace etalon
