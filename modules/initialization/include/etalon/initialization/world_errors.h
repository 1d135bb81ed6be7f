#pragma once

#include <Eigen/Core>

namespace etalon {

/**
 * InitializationResult::covariance from that of the errors in V, the frame of the first body.
 * @param P of [b_g, b_a, g_V, v of the last keyframe in V], estimate less truth
 * @param g_V gravity, m/s^2
 * @param v_V velocity of the last keyframe, m/s
 * @return 11 x 11
 */
Eigen::MatrixXd covarianceInWorld(const Eigen::Matrix<double, 12, 12>& P,
                                  const Eigen::Vector3d& g_V, const Eigen::Vector3d& v_V);

}  // namespace etalon
