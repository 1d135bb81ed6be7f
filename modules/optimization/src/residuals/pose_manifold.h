#pragma once

// A pose as a parameter block of Ceres. Private to the module.

#include <ceres/manifold.h>

#include <Eigen/Geometry>
#include <array>

#include "etalon/core/se3.h"

namespace etalon {

/** Quaternion (x, y, z, w), position. */
using PoseBlock = std::array<double, 7>;

PoseBlock toBlock(const SE3& T_WB);
SE3 fromBlock(const double* block);

/**
 * Right perturbation of a PoseBlock: R Exp(d), p + t; tangent 6, [rotation, position]. Ceres' own
 * EigenQuaternionManifold turns from the left and by half the angle; the covariances of this module
 * are by the right perturbation.
 */
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/** Ceres' memory order; a single column is column-major for Eigen. */
template <int Rows, int Cols>
using RowMajor = Eigen::Matrix<double, Rows, Cols, Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

/** Derivatives of the right perturbation by the quaternion of `block`: the corner of
 * PoseManifold::MinusJacobian() that is not the identity. */
RowMajor<3, 4> tangentByQuaternion(const double* block);

/**
 * Writes a Jacobian by the tangent of the pose `block` the way Ceres wants it, by the block's seven
 * numbers: times PlusJacobian() it is `by_tangent` again.
 */
template <int Rows>
void writePoseJacobian(const Eigen::Matrix<double, Rows, 6>& by_tangent, const double* block,
                       double* jacobian) {
  Eigen::Map<RowMajor<Rows, 7>> out(jacobian);
  out.template leftCols<4>().noalias() =
      by_tangent.template leftCols<3>().lazyProduct(tangentByQuaternion(block));
  out.template rightCols<3>() = by_tangent.template rightCols<3>();
}

}  // namespace etalon
