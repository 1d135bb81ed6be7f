#pragma once

#include <Eigen/Core>

namespace etalon {

/** A rigid transform T_AB: p_A = R p_B + t. Name its instances T_AB; adjacent letters cancel. */
struct SE3 {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();  ///< m

  SE3() = default;
  SE3(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : R(rotation), t(translation) {}

  SE3 operator*(const SE3& other) const { return {R * other.R, R * other.t + t}; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return R * p + t; }
  SE3 inverse() const { return {R.transpose(), -(R.transpose() * t)}; }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
    T.topLeftCorner<3, 3>() = R;
    T.topRightCorner<3, 1>() = t;
    return T;
  }
};

}  // namespace etalon
