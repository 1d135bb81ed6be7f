#include "etalon/initialization/predicted_errors.h"

namespace etalon {

Eigen::MatrixXd claimedCovariance(const VisualInertialBaResult& result) {
  const Eigen::Index n = result.states.size();
  if (n == 0 || result.covariance.rows() != 9 * n + 6) return {};
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(11, 9 * n + 6);
  J.block<6, 6>(0, 9 * n).setIdentity();
  J.block<2, 3>(6, 0) = result.states.front().T_WB.R.topRows<2>();  // from the body to the world
  J.block<3, 3>(8, 9 * (n - 1) + 6).setIdentity();
  return J * result.covariance * J.transpose();
}

}  // namespace etalon
