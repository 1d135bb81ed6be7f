#include "etalon/core/so3.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace etalon {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/** The series of Rodrigues' formula, of the squared angle. */
struct RotationSeries {
  double a;  ///< sin(theta) / theta
  double b;  ///< (1 - cos(theta)) / theta^2
  double c;  ///< (theta - sin(theta)) / theta^3

  explicit RotationSeries(double theta2) {
    // Below this squared angle (rad^2) five terms are exact to double precision.
    constexpr double kSmallAngle2 = 1e-2;
    if (theta2 < kSmallAngle2) {
      const double x = theta2;
      b = 1.0 / 2 - x * (1.0 / 24 - x * (1.0 / 720 - x * (1.0 / 40320 - x / 3628800)));
      c = 1.0 / 6 - x * (1.0 / 120 - x * (1.0 / 5040 - x * (1.0 / 362880 - x / 39916800)));
      a = 1.0 - x * c;
    } else {
      const double theta = std::sqrt(theta2);
      const double sin_half = std::sin(0.5 * theta);
      a = std::sin(theta) / theta;
      b = 2.0 * sin_half * sin_half / theta2;
      c = (1.0 - a) / theta2;
    }
  }
};

}  // namespace

Matrix3d expSO3(const Vector3d& phi) {
  const RotationSeries of(phi.squaredNorm());
  const Matrix3d K = hat(phi);
  return Matrix3d::Identity() + of.a * K + of.b * (K * K);
}

Vector3d logSO3(const Matrix3d& R) {
  // Through the quaternion: Eigen picks the largest component, which keeps it accurate up to pi.
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() *= -1.0;
  const double n = q.vec().norm();
  if (n < 1e-7) return (2.0 / q.w()) * q.vec();  // error below n^2/3 relative
  return (2.0 * std::atan2(n, q.w()) / n) * q.vec();
}

Matrix3d rightJacobianSO3(const Vector3d& phi) {
  const RotationSeries of(phi.squaredNorm());
  const Matrix3d K = hat(phi);
  return Matrix3d::Identity() - of.b * K + of.c * (K * K);
}

Matrix3d rightJacobianInverseSO3(const Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  double c;  // 1/theta^2 - (1 + cos)/(2 theta sin)
  if (theta2 < 1e-6) {
    c = 1.0 / 12.0 + theta2 / 720.0;
  } else {
    const double theta = std::sqrt(theta2);
    // (1 + cos)/sin = cot(theta/2), which is well behaved at pi.
    c = 1.0 / theta2 - 1.0 / (2.0 * theta * std::tan(0.5 * theta));
  }
  const Matrix3d K = hat(phi);
  return Matrix3d::Identity() + 0.5 * K + c * (K * K);
}

Matrix3d nearestRotation(const Matrix3d& R) {
  const Eigen::JacobiSVD<Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d D = Matrix3d::Identity();
  D(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  return svd.matrixU() * D * svd.matrixV().transpose();
}

double angleBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Matrix3d rotationBetween(const Vector3d& from, const Vector3d& to) {
  const Vector3d a = from.normalized(), b = to.normalized();
  if (a.dot(b) >= 0.0) return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
  // More than a right angle: half a turn about the same axis takes a to -a, a small one back to b.
  // (The direct formula loses half the digits near opposite directions.)
  Vector3d axis = a.cross(b);
  axis -= a.dot(axis) * a;
  axis = axis.norm() > 1e-12 ? axis.normalized() : a.unitOrthogonal();
  const Matrix3d half_turn = 2.0 * axis * axis.transpose() - Matrix3d::Identity();
  return Eigen::Quaterniond::FromTwoVectors(-a, b).toRotationMatrix() * half_turn;
}

Eigen::Matrix<double, 3, 2> tangentBasis(const Eigen::Vector3d& v) {
  const Eigen::Vector3d d = v.normalized();
  const Eigen::Vector3d axis =
      std::abs(d.x()) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Eigen::Matrix<double, 3, 2> B;
  B.col(0) = d.cross(axis).normalized();
  B.col(1) = d.cross(B.col(0));
  return B;
}

}  // namespace etalon
