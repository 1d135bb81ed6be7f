#include "etalon/initialization/steps/world_errors.h"

#include "etalon/core/so3.h"

namespace etalon {

Eigen::MatrixXd covarianceInWorld(const Eigen::MatrixXd& P, const Eigen::Matrix3d& R_WV,
                                  const Eigen::Vector3d& v_WB, double gravity_mps2) {
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(P.rows() - 1, P.cols());
  G.topLeftCorner<6, 6>().setIdentity();
  // R_WV turns g_V to -z: an error of g_V, R_WV e = (e_x, e_y, .), tilts W by (-e_y, e_x) / g.
  G.block<1, 3>(6, 6) = -R_WV.row(1) / gravity_mps2;
  G.block<1, 3>(7, 6) = R_WV.row(0) / gravity_mps2;
  G.block<3, 3>(8, 9) = R_WV;
  // Velocities are compared in the true world, which the tilt turns.
  G.middleRows<3>(8) -= hat(v_WB).leftCols<2>() * G.middleRows<2>(6);
  // Relative to the first body the poses are the same in any world.
  const Eigen::Index poses = P.rows() - 12;
  G.bottomRightCorner(poses, poses).setIdentity();
  const Eigen::MatrixXd result = G * P * G.transpose();
  return 0.5 * (result + result.transpose());
}

}  // namespace etalon
