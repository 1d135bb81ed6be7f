#pragma once

#include <Eigen/Core>

namespace etalon {

/**
 * Initialization::covariance from that of the errors in V, the frame of the first body.
 * @param P of [b_g, b_a, g_V, v of the last keyframe in V, poses of the other keyframes in V],
 *        estimate less truth; the poses, [rotation, position] of each, may be missing
 * @param R_WV turns g_V to -z
 * @param v_WB velocity of the last keyframe in W, m/s
 * @return a row less than P
 */
Eigen::MatrixXd covarianceInWorld(const Eigen::MatrixXd& P, const Eigen::Matrix3d& R_WV,
                                  const Eigen::Vector3d& v_WB, double gravity_mps2);

}  // namespace etalon
