#include "etalon/initialization/estimation_error.h"

#include <Eigen/Geometry>

#include "etalon/core/so3.h"

namespace etalon {

Eigen::Matrix<double, 11, 1> estimationError(const std::vector<StampedState>& states,
                                             const ImuBias& bias, const WindowTruth& truth) {
  // q = swing * twist, the twist about z, the swing about a horizontal axis.
  const Eigen::Quaterniond q(Eigen::Matrix3d(states.front().T_WB.R * truth.R_WB0.transpose()));
  const Eigen::Quaterniond twist = Eigen::Quaterniond(q.w(), 0.0, 0.0, q.z()).normalized();
  const Eigen::Vector3d tilt = logSO3((q * twist.inverse()).toRotationMatrix());
  Eigen::Matrix<double, 11, 1> error;
  error << bias.gyro - truth.bias.gyro, bias.accel - truth.bias.accel, tilt.head<2>(),
      states.back().v_WB - twist * truth.v_WB;
  return error;
}

}  // namespace etalon
