#include "residuals/ceres_blocks.h"

#include "etalon/core/so3.h"

namespace etalon {

using Eigen::Map;
using Eigen::Vector3d;
template <int R, int C>
using RowMajor = Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

PoseBlock toBlock(const SE3& T_WB) {
  PoseBlock block;
  Map<Eigen::Quaterniond>(block.data()) = Eigen::Quaterniond(T_WB.R).normalized();
  Map<Vector3d>(block.data() + 4) = T_WB.t;
  return block;
}

SE3 fromBlock(const double* block) {
  return {Map<const Eigen::Quaterniond>(block).toRotationMatrix(), Map<const Vector3d>(block + 4)};
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Map<const Vector3d> d(delta);
  const double angle = d.norm();
  // Half-angle sine over angle; its series is exact to double precision below 1e-4.
  const double s = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  const Eigen::Quaterniond dq(std::cos(0.5 * angle), s * d.x(), s * d.y(), s * d.z());
  Map<Eigen::Quaterniond>(x_plus_delta).coeffs() =
      (Map<const Eigen::Quaterniond>(x) * dq).normalized().coeffs();
  Map<Vector3d>(x_plus_delta + 4) = Map<const Vector3d>(x + 4) + Map<const Vector3d>(delta + 3);
  return true;
}

bool PoseManifold::PlusJacobian(const double*, double* jacobian) const {
  Map<RowMajor<7, 6>> J(jacobian);
  J.setZero();
  J.topRows<6>().setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const SE3 T_y = fromBlock(y), T_x = fromBlock(x);
  Map<Vector3d>(y_minus_x, 3) = logSO3(T_x.R.transpose() * T_y.R);
  Map<Vector3d>(y_minus_x + 3, 3) = T_y.t - T_x.t;
  return true;
}

bool PoseManifold::MinusJacobian(const double*, double* jacobian) const {
  Map<RowMajor<6, 7>> J(jacobian);
  J.setZero();
  J.leftCols<6>().setIdentity();
  return true;
}

bool ReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_landmark;
  const bool derive = jacobians != nullptr;
  InverseDepthLandmark landmark = landmark_;
  landmark.parameters = Map<const Vector3d>(parameters[1]);
  if (!reprojectionResidual(T_CB_, measurement_, fromBlock(parameters[0]), landmark, &r,
                            derive ? &J_pose : nullptr, derive ? &J_landmark : nullptr)) {
    r = {kGrossOutlier, 0.0};
    J_pose.setZero();
    J_landmark.setZero();
  }
  Map<Eigen::Vector2d>{residuals} = r;
  if (!derive) return true;
  if (jacobians[0]) {
    Map<RowMajor<2, 7>> J(jacobians[0]);
    J.leftCols<6>() = J_pose;
    J.col(6).setZero();
  }
  if (jacobians[1]) {
    if (held_) J_landmark.col(2).setZero();
    Map<RowMajor<2, 3>>{jacobians[1]} = J_landmark;
  }
  return true;
}

bool PreintegrationCost::Evaluate(double const* const* parameters, double* residuals,
                                  double** jacobians) const {
  const ImuBias bias{Map<const Vector3d>(parameters[4]), Map<const Vector3d>(parameters[4] + 3)};
  PreintegrationJacobians J;
  const Eigen::Matrix<double, 9, 1> r = preintegrationResidual(
      preintegration_, fromBlock(parameters[0]), Map<const Vector3d>(parameters[1]),
      fromBlock(parameters[2]), Map<const Vector3d>(parameters[3]), bias, g_W_,
      jacobians ? &J : nullptr);
  Map<Eigen::Matrix<double, 9, 1>>{residuals} = L_ * r;
  if (!jacobians) return true;
  for (int side = 0; side < 2; ++side) {
    if (double* out = jacobians[2 * side]) {
      Map<RowMajor<9, 7>> J_pose(out);
      J_pose.leftCols<6>() = L_ * (side == 0 ? J.pose_i : J.pose_j);
      J_pose.col(6).setZero();
    }
    if (double* out = jacobians[2 * side + 1])
      Map<RowMajor<9, 3>>{out} = L_ * (side == 0 ? J.velocity_i : J.velocity_j);
  }
  if (jacobians[4]) {
    Map<RowMajor<9, 6>> J_bias(jacobians[4]);
    J_bias.leftCols<3>() = L_ * J.bias_gyro;
    J_bias.rightCols<3>() = L_ * J.bias_accel;
  }
  return true;
}

BiasPriorCost::BiasPriorCost(const ImuBias& mean, double sigma_gyro_rps, double sigma_accel_mps2) {
  mean_ << mean.gyro, mean.accel;
  inverse_sigma_ << Vector3d::Constant(1.0 / sigma_gyro_rps),
      Vector3d::Constant(1.0 / sigma_accel_mps2);
}

bool BiasPriorCost::Evaluate(double const* const* parameters, double* residuals,
                             double** jacobians) const {
  Map<Eigen::Matrix<double, 6, 1>>{residuals} =
      inverse_sigma_.cwiseProduct(Map<const Eigen::Matrix<double, 6, 1>>(parameters[0]) - mean_);
  if (jacobians && jacobians[0]) Map<RowMajor<6, 6>>{jacobians[0]} = inverse_sigma_.asDiagonal();
  return true;
}

SharedErrorCost::SharedErrorCost(double sigma_rad) {
  inverse_sigma_ << Vector3d::Constant(1.0 / sigma_rad),
      Vector3d::Constant(GaugeCost::kInverseSigma);
}

bool SharedErrorCost::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  const SE3 body = fromBlock(parameters[0]), seen = fromBlock(parameters[1]);
  const Eigen::Matrix3d R = body.R.transpose() * seen.R;
  Eigen::Matrix<double, 6, 1> r;
  r << logSO3(R), seen.t - body.t;
  Map<Eigen::Matrix<double, 6, 1>>{residuals} = inverse_sigma_.cwiseProduct(r);
  if (!jacobians) return true;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Identity();
  J.topLeftCorner<3, 3>() = rightJacobianInverseSO3(r.head<3>());
  J = inverse_sigma_.asDiagonal() * J;
  for (int side = 0; side < 2; ++side) {
    if (!jacobians[side]) continue;
    Map<RowMajor<6, 7>> out(jacobians[side]);
    out.col(6).setZero();
    out.leftCols<6>() = J;
    if (side == 1) continue;
    out.topLeftCorner<3, 3>() = -J.topLeftCorner<3, 3>() * R.transpose();
    out.block<3, 3>(3, 3) *= -1.0;
  }
  return true;
}

bool GaugeCost::Evaluate(double const* const* parameters, double* residuals,
                         double** jacobians) const {
  const SE3 T_WB = fromBlock(parameters[0]);
  const Vector3d phi = logSO3(T_WB.R * T_WB_.R.transpose());  // perturbation in W; its z is the yaw
  Map<Vector3d>{residuals} = kInverseSigma * (T_WB.t - T_WB_.t);
  residuals[3] = kInverseSigma * phi.z();
  if (jacobians && jacobians[0]) {
    Map<RowMajor<4, 7>> J(jacobians[0]);
    J.setZero();
    J.block<3, 3>(0, 3).diagonal().setConstant(kInverseSigma);
    // R Exp(d) R0^T = Exp(phi) Exp(R0 d) with R0 the reference rotation.
    J.block<1, 3>(3, 0) = kInverseSigma * (rightJacobianInverseSO3(phi) * T_WB_.R).row(2);
  }
  return true;
}

}  // namespace etalon
