#pragma once

#include <Eigen/Core>
#include <cmath>

namespace etalon {

/** U, upper triangular, with U U^T the inverse of the symmetric V, whose lower triangle is read
 * (Cholesky, written out). Not finite if V is not positive definite. */
inline Eigen::Matrix3d inverseRoot(const Eigen::Matrix3d& V) {
  const double u00 = 1.0 / std::sqrt(V(0, 0));
  const double l10 = V(1, 0) * u00, l20 = V(2, 0) * u00;
  const double u11 = 1.0 / std::sqrt(V(1, 1) - l10 * l10);
  const double l21 = (V(2, 1) - l20 * l10) * u11;
  const double u22 = 1.0 / std::sqrt(V(2, 2) - l20 * l20 - l21 * l21);
  const double u01 = -l10 * u00 * u11;
  Eigen::Matrix3d U;
  U << u00, u01, -(l20 * u00 + l21 * u01) * u22,  //
      0.0, u11, -l21 * u11 * u22,                 //
      0.0, 0.0, u22;
  return U;
}

/** What is best where the third coordinate is `third`, `best` being so where it is free.
 * @param root of the inverse of the information: inverseRoot() of it */
inline Eigen::Vector3d withThird(const Eigen::Vector3d& best, double third,
                                 const Eigen::Matrix3d& root) {
  const Eigen::Vector3d with_third = root * root.row(2).transpose();
  return best - (best.z() - third) / with_third.z() * with_third;
}

}  // namespace etalon
