#pragma once

#include <Eigen/Core>

namespace etalon {

/** Skew-symmetric matrix: hat(a) b = a x b. */
inline Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/** Rotation vector (rad) to rotation matrix. */
Eigen::Matrix3d expSO3(const Eigen::Vector3d& phi);

/** Rotation matrix to rotation vector (rad), norm in [0, pi]; stable near 0 and near pi. */
Eigen::Vector3d logSO3(const Eigen::Matrix3d& R);

/** Right Jacobian: Exp(phi + d) ~ Exp(phi) Exp(Jr(phi) d). */
Eigen::Matrix3d rightJacobianSO3(const Eigen::Vector3d& phi);

/** Inverse of the right Jacobian: Log(Exp(phi) Exp(d)) ~ phi + Jr^-1(phi) d. Singular at 2 pi. */
Eigen::Matrix3d rightJacobianInverseSO3(const Eigen::Vector3d& phi);

/** The rotation matrix nearest to R (Frobenius), for R that drifted by rounding. */
Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& R);

/** Angle in radians between two non-zero vectors, accurate for small angles as well. */
double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/** The rotation of least angle that takes the direction of `from` to that of `to`. */
Eigen::Matrix3d rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/** Two unit vectors that span the plane orthogonal to `v`, 3x2. */
Eigen::Matrix<double, 3, 2> tangentBasis(const Eigen::Vector3d& v);

}  // namespace etalon
