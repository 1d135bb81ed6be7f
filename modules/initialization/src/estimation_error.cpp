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

Eigen::VectorXd relativePoseErrors(const std::vector<StampedState>& states,
                                   const std::vector<StampedState>& truth) {
  Eigen::VectorXd errors(6 * (states.size() - 1));
  for (size_t k = 1; k < states.size(); ++k) {
    const SE3 estimated = states.front().T_WB.inverse() * states[k].T_WB;
    const SE3 true_pose = truth.front().T_WB.inverse() * truth[k].T_WB;
    errors.segment<6>(6 * static_cast<Eigen::Index>(k - 1))
        << logSO3(true_pose.R.transpose() * estimated.R),
        estimated.t - true_pose.t;
  }
  return errors;
}

Eigen::MatrixXd covarianceAround(const Initialization& better, const Initialization& estimate) {
  const Eigen::MatrixXd& P = better.covariance;
  if (P.size() == 0) return {};
  Eigen::VectorXd d(P.rows());
  d.head<11>() =
      estimationError(estimate.states, estimate.bias,
                      {better.states.front().T_WB.R, better.states.back().v_WB, better.bias});
  if (P.rows() > 11) d.tail(P.rows() - 11) = relativePoseErrors(estimate.states, better.states);
  return d * d.transpose() + P;
}

}  // namespace etalon
