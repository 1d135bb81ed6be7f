#include "etalon/initialization/world_errors.h"

#include "etalon/core/so3.h"

namespace etalon {

Eigen::MatrixXd covarianceInWorld(const Eigen::Matrix<double, 12, 12>& P,
                                  const Eigen::Vector3d& g_V, const Eigen::Vector3d& v_V) {
  const Eigen::Matrix3d R_WV = rotationBetween(g_V, -Eigen::Vector3d::UnitZ());
  Eigen::Matrix<double, 11, 12> G = Eigen::Matrix<double, 11, 12>::Zero();
  G.topLeftCorner<6, 6>().setIdentity();
  // R_WV turns g_V to -z: an error of g_V, R_WV e = (e_x, e_y, .), tilts W by (-e_y, e_x) / g.
  G.block<1, 3>(6, 6) = -R_WV.row(1) / g_V.norm();
  G.block<1, 3>(7, 6) = R_WV.row(0) / g_V.norm();
  G.bottomRightCorner<3, 3>() = R_WV;
  // Velocities are compared in the true world, which the tilt turns.
  G.bottomRows<3>() -= hat(R_WV * v_V).leftCols<2>() * G.middleRows<2>(6);
  const Eigen::Matrix<double, 11, 11> result = G * P * G.transpose();
  return 0.5 * (result + result.transpose());
}

}  // namespace etalon
