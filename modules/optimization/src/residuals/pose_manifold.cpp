#include "residuals/pose_manifold.h"

#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {

using Eigen::Map;
using Eigen::Quaterniond;
using Eigen::Vector3d;

PoseBlock toBlock(const SE3& T_WB) {
  PoseBlock block;
  Map<Quaterniond>(block.data()) = Quaterniond(T_WB.R).normalized();
  Map<Vector3d>(block.data() + 4) = T_WB.t;
  return block;
}

SE3 fromBlock(const double* block) {
  return {Map<const Quaterniond>(block).toRotationMatrix(), Map<const Vector3d>(block + 4)};
}

namespace {

/** q (v, 0) = Q v, in the order (x, y, z, w); Q^T Q = I for a unit quaternion. */
Eigen::Matrix<double, 4, 3> quaternionProduct(const double* q) {
  Eigen::Matrix<double, 4, 3> Q;
  Q.topRows<3>() = hat(Vector3d(q[0], q[1], q[2]));
  Q.topRows<3>().diagonal().setConstant(q[3]);
  Q.bottomRows<1>() << -q[0], -q[1], -q[2];
  return Q;
}

}  // namespace

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Map<const Vector3d> d(delta);
  const double angle = d.norm();
  // Half-angle sine over angle; its series is exact to double precision below 1e-4.
  const double s = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Quaterniond dq(std::cos(0.5 * angle), s * d.x(), s * d.y(), s * d.z());
  Map<Quaterniond>(x_plus_delta).coeffs() = (Map<const Quaterniond>(x) * dq).normalized().coeffs();
  Map<Vector3d>(x_plus_delta + 4) = Map<const Vector3d>(x + 4) + Map<const Vector3d>(delta + 3);
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  Map<RowMajor<7, 6>> J(jacobian);
  J.setZero();
  J.topLeftCorner<4, 3>() = 0.5 * quaternionProduct(x);
  J.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  // From the quaternions themselves: y and -y are two blocks, and Plus() gets to the one given.
  const Quaterniond dq = Map<const Quaterniond>(x).conjugate() * Map<const Quaterniond>(y);
  const double sine = dq.vec().norm();
  const double scale = sine < 1e-300 ? 2.0 / dq.w() : 2.0 * std::atan2(sine, dq.w()) / sine;
  Map<Vector3d>(y_minus_x, 3) = scale * dq.vec();
  Map<Vector3d>(y_minus_x + 3, 3) = Map<const Vector3d>(y + 4) - Map<const Vector3d>(x + 4);
  return true;
}

RowMajor<3, 4> tangentByQuaternion(const double* block) {
  return 2.0 * quaternionProduct(block).transpose();
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  Map<RowMajor<6, 7>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 4>() = tangentByQuaternion(x);
  J.bottomRightCorner<3, 3>().setIdentity();
  return true;
}

}  // namespace etalon
