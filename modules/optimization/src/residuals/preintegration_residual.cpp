#include "etalon/optimization/residuals/preintegration_residual.h"

#include <Eigen/Cholesky>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

// Rows of the residual are those of the state.
constexpr int kRotation = state_index::kRotation;
constexpr int kPosition = state_index::kPosition;
constexpr int kVelocity = state_index::kVelocity;

void setZero(PreintegrationJacobians* J) {
  J->pose_i.setZero();
  J->pose_j.setZero();
  J->velocity_i.setZero();
  J->velocity_j.setZero();
  J->bias_gyro.setZero();
  J->bias_accel.setZero();
  J->gravity.setZero();
}

}  // namespace

Eigen::Matrix<double, 9, 1> preintegrationResidual(const Preintegration& preintegration,
                                                   const SE3& T_WBi, const Vector3d& v_i,
                                                   const SE3& T_WBj, const Vector3d& v_j,
                                                   const ImuBias& bias, const Vector3d& g_W,
                                                   PreintegrationJacobians* J) {
  const double dt = preintegration.dt();
  const Preintegration::Deltas deltas = preintegration.corrected(bias);
  const Matrix3d R_BiW = T_WBi.R.transpose();
  const Matrix3d R_BiBj = R_BiW * T_WBj.R;
  const Vector3d dp = R_BiW * (T_WBj.t - T_WBi.t - v_i * dt - 0.5 * dt * dt * g_W);
  const Vector3d dv = R_BiW * (v_j - v_i - g_W * dt);

  Eigen::Matrix<double, 9, 1> r;
  r.segment<3>(kRotation) = logSO3(deltas.dR.transpose() * R_BiBj);
  r.segment<3>(kPosition) = dp - deltas.dp;
  r.segment<3>(kVelocity) = dv - deltas.dv;
  if (!J) return r;

  setZero(J);
  const Vector3d r_R = r.segment<3>(kRotation);
  const Matrix3d Jr_inverse = rightJacobianInverseSO3(r_R);
  J->pose_i.block<3, 3>(kRotation, 0) = -Jr_inverse * R_BiBj.transpose();
  J->pose_i.block<3, 3>(kPosition, 0) = hat(dp);
  J->pose_i.block<3, 3>(kVelocity, 0) = hat(dv);
  J->pose_i.block<3, 3>(kPosition, 3) = -R_BiW;
  J->pose_j.block<3, 3>(kRotation, 0) = Jr_inverse;
  J->pose_j.block<3, 3>(kPosition, 3) = R_BiW;
  J->velocity_i.middleRows<3>(kPosition) = -dt * R_BiW;
  J->velocity_i.middleRows<3>(kVelocity) = -R_BiW;
  J->velocity_j.middleRows<3>(kVelocity) = R_BiW;
  // The correction Exp(dR_dbg (b_g - b_g0)) moves by the right Jacobian at its own angle.
  const Vector3d correction = preintegration.dR_dbg() * (bias.gyro - preintegration.bias().gyro);
  J->bias_gyro.middleRows<3>(kRotation) =
      -Jr_inverse * expSO3(-r_R) * rightJacobianSO3(correction) * preintegration.dR_dbg();
  J->bias_gyro.middleRows<3>(kPosition) = -preintegration.dp_dbg();
  J->bias_gyro.middleRows<3>(kVelocity) = -preintegration.dv_dbg();
  J->bias_accel.middleRows<3>(kPosition) = -preintegration.dp_dba();
  J->bias_accel.middleRows<3>(kVelocity) = -preintegration.dv_dba();
  J->gravity.middleRows<3>(kPosition) = -0.5 * dt * dt * R_BiW;
  J->gravity.middleRows<3>(kVelocity) = -dt * R_BiW;
  return r;
}

Matrix9d sqrtInformation(const Preintegration& preintegration) {
  const Eigen::LLT<Matrix9d> factor(preintegration.covariance9());
  const Matrix9d C = factor.matrixL();
  if (factor.info() != Eigen::Success || !C.allFinite())  // NaN passes LLT unnoticed
    throw DataError("", 0,
                    "the preintegration's covariance is not positive definite; expected at least "
                    "two IMU samples and white-noise densities above zero");
  return C.triangularView<Eigen::Lower>().solve(Matrix9d::Identity());
}

}  // namespace etalon
