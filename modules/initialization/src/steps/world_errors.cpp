#include "etalon/initialization/steps/world_errors.h"

#include "etalon/core/so3.h"

namespace etalon {

Eigen::MatrixXd covarianceInWorld(const Eigen::Matrix<double, 12, 12>& P,
                                  const Eigen::Matrix3d& R_WV, const Eigen::Vector3d& v_WB,
                                  double gravity_mps2) {
  Eigen::Matrix<double, 11, 12> G = Eigen::Matrix<double, 11, 12>::Zero();
  G.topLeftCorner<6, 6>().setIdentity();
  // R_WV turns g_V to -z: an error of g_V, R_WV e = (e_x, e_y, .), tilts W by (-e_y, e_x) / g.
  G.block<1, 3>(6, 6) = -R_WV.row(1) / gravity_mps2;
  G.block<1, 3>(7, 6) = R_WV.row(0) / gravity_mps2;
  G.bottomRightCorner<3, 3>() = R_WV;
  // Velocities are compared in the true world, which the tilt turns.
  G.bottomRows<3>() -= hat(v_WB).leftCols<2>() * G.middleRows<2>(6);
  const Eigen::Matrix<double, 11, 11> result = G * P * G.transpose();
  return 0.5 * (result + result.transpose());
}

}  // namespace etalon
