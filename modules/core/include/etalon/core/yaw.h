#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/se3.h"

namespace etalon {

/**
 * The turn about z that aligns best: the angle in rad, within +-pi, that makes trace(Rz(angle)^T M)
 * greatest, which is cos(angle) (m00 + m11) + sin(angle) (m10 - m01) + m22. M = sum to_i from_i^T
 * for vectors that are to be aligned, R_to R_from^T for rotations.
 */
inline double aligningYaw(const Eigen::Matrix3d& M) {
  return std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1));
}

/** @param angle rad */
inline Eigen::Matrix3d turnAboutZ(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

/**
 * T_WG, a turn about z and a translation, which takes the pose T_GB to T_WB: the position exactly,
 * the attitude as well as a turn about z can. Both worlds have z up.
 */
inline SE3 yawPositionAlignment(const SE3& T_GB, const SE3& T_WB) {
  const Eigen::Matrix3d R_WG = turnAboutZ(aligningYaw(T_WB.R * T_GB.R.transpose()));
  return {R_WG, T_WB.t - R_WG * T_GB.t};
}

}  // namespace etalon
