#include "etalon/optimization/residuals/inertial_residual.h"

#include <Eigen/Cholesky>

#include "etalon/core/errors.h"

namespace etalon {

namespace ix = state_index;
using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Vector15d = Eigen::Matrix<double, 15, 1>;

Vector15d inertialResidual(const Preintegration& preintegration, const NavState& state_i,
                           const NavState& state_j, const Eigen::Vector3d& g_W, Matrix15d* J_i,
                           Matrix15d* J_j) {
  PreintegrationJacobians J;
  const bool derive = J_i != nullptr || J_j != nullptr;
  Vector15d r;
  r.head<9>() = preintegrationResidual(preintegration, state_i.T_WB, state_i.v_WB, state_j.T_WB,
                                       state_j.v_WB, state_i.bias, g_W, derive ? &J : nullptr);
  r.segment<3>(ix::kGyroBias) = state_j.bias.gyro - state_i.bias.gyro;
  r.segment<3>(ix::kAccelBias) = state_j.bias.accel - state_i.bias.accel;
  if (J_i) {
    J_i->setZero();
    J_i->topRows<9>() << J.pose_i, J.velocity_i, J.bias_gyro, J.bias_accel;
    J_i->bottomRightCorner<6, 6>().diagonal().setConstant(-1.0);
  }
  if (J_j) {
    J_j->setZero();
    J_j->topLeftCorner<9, 9>() << J.pose_j, J.velocity_j;
    J_j->bottomRightCorner<6, 6>().setIdentity();
  }
  return r;
}

Matrix15d inertialSqrtInformation(const Preintegration& preintegration) {
  // Cholesky from the last row up, covariance = U U^T with U upper triangular; then L = U^-1.
  const Eigen::LLT<Matrix15d> reversed(preintegration.covariance().reverse());
  const Matrix15d C = reversed.matrixL();
  if (reversed.info() != Eigen::Success || !C.allFinite())  // NaN passes LLT unnoticed
    throw DataError("", 0,
                    "the preintegration's covariance is not positive definite; expected at least "
                    "two IMU samples, and noise densities and random walks above zero");
  const Matrix15d U = C.reverse();
  return U.triangularView<Eigen::Upper>().solve(Matrix15d::Identity());
}

}  // namespace etalon
