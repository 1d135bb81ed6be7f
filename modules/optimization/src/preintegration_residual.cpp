#include "etalon/optimization/preintegration_residual.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "etalon/core/so3.h"

namespace etalon {
using Eigen::Matrix3d;
using Eigen::Vector3d;

Eigen::Matrix<double, 9, 1> preintegrationResidual(const Preintegration& preintegration,
                                                   const SE3& T_WBi, const Vector3d& v_i,
                                                   const SE3& T_WBj, const Vector3d& v_j,
                                                   const ImuBias& bias, const Vector3d& g_W,
                                                   PreintegrationJacobians* J) {
  const Preintegration::Deltas d = preintegration.corrected(bias);
  const double dt = preintegration.dt();
  const Matrix3d R_iT = T_WBi.R.transpose();
  const Matrix3d E = d.dR.transpose() * R_iT * T_WBj.R;
  const Vector3d r_R = logSO3(E);
  const Vector3d p_i = R_iT * (T_WBj.t - T_WBi.t - v_i * dt - 0.5 * dt * dt * g_W);
  const Vector3d v_ij = R_iT * (v_j - v_i - g_W * dt);
  Eigen::Matrix<double, 9, 1> r;
  r << r_R, p_i - d.dp, v_ij - d.dv;
  if (!J) return r;
  const Matrix3d Jinv = rightJacobianInverseSO3(r_R);
  J->pose_i.setZero();
  J->pose_j.setZero();
  J->velocity_i.setZero();
  J->velocity_j.setZero();
  J->bias_gyro.setZero();
  J->bias_accel.setZero();
  J->gravity.setZero();
  J->pose_i.block<3, 3>(0, 0) = -Jinv * T_WBj.R.transpose() * T_WBi.R;
  J->pose_i.block<3, 3>(3, 0) = hat(p_i);
  J->pose_i.block<3, 3>(6, 0) = hat(v_ij);
  J->pose_i.block<3, 3>(3, 3) = -R_iT;
  J->pose_j.block<3, 3>(0, 0) = Jinv;
  J->pose_j.block<3, 3>(3, 3) = R_iT;
  J->velocity_i.middleRows<3>(3) = -R_iT * dt;
  J->velocity_i.bottomRows<3>() = -R_iT;
  J->velocity_j.bottomRows<3>() = R_iT;
  const Vector3d phi = preintegration.dR_dbg() * (bias.gyro - preintegration.bias().gyro);
  J->bias_gyro.topRows<3>() =
      -Jinv * E.transpose() * rightJacobianSO3(phi) * preintegration.dR_dbg();
  J->bias_gyro.middleRows<3>(3) = -preintegration.dp_dbg();
  J->bias_gyro.bottomRows<3>() = -preintegration.dv_dbg();
  J->bias_accel.middleRows<3>(3) = -preintegration.dp_dba();
  J->bias_accel.bottomRows<3>() = -preintegration.dv_dba();
  J->gravity.middleRows<3>(3) = -0.5 * dt * dt * R_iT;
  J->gravity.bottomRows<3>() = -dt * R_iT;
  return r;
}

Eigen::Matrix<double, 9, 9> sqrtInformation(const Preintegration& preintegration) {
  using Matrix9d = Eigen::Matrix<double, 9, 9>;
  const Matrix9d information = preintegration.covariance9().llt().solve(Matrix9d::Identity());
  return information.llt().matrixU();
}
}  // namespace etalon
