#include "etalon/core/nav_state.h"

#include "etalon/core/so3.h"

namespace etalon {

namespace ix = state_index;
using Vector15d = Eigen::Matrix<double, 15, 1>;

NavState NavState::plus(const Vector15d& d) const {
  NavState out;
  out.T_WB = {T_WB.R * expSO3(d.segment<3>(ix::kRotation)), T_WB.t + d.segment<3>(ix::kPosition)};
  out.v_WB = v_WB + d.segment<3>(ix::kVelocity);
  out.bias = {bias.gyro + d.segment<3>(ix::kGyroBias), bias.accel + d.segment<3>(ix::kAccelBias)};
  return out;
}

Vector15d NavState::minus(const NavState& other) const {
  Vector15d d;
  d << logSO3(other.T_WB.R.transpose() * T_WB.R), T_WB.t - other.T_WB.t, v_WB - other.v_WB,
      bias.gyro - other.bias.gyro, bias.accel - other.bias.accel;
  return d;
}

Eigen::Matrix<double, 15, 15> errorsTurned(const Eigen::Matrix3d& R_WW0) {
  Eigen::Matrix<double, 15, 15> turn = Eigen::Matrix<double, 15, 15>::Identity();
  turn.block<3, 3>(ix::kPosition, ix::kPosition) = R_WW0;
  turn.block<3, 3>(ix::kVelocity, ix::kVelocity) = R_WW0;
  return turn;
}

}  // namespace etalon
