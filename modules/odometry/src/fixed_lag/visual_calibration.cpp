// The columns of the calibration in the pixels' equations.

#include <Eigen/Geometry>

#include "etalon/core/so3.h"
#include "visual_terms.h"

namespace etalon::fixed_lag {

/** All images are later by as much: each moves with its body. */
Eigen::VectorXd VisualTerms::twistsByTimeOffset(const Window& window) const {
  Eigen::VectorXd twists(6 * T_NI_.size());
  for (size_t k = 0; k < T_NI_.size(); ++k) {
    const WindowState& state = window.states[k];
    const Eigen::Vector3d turn = T_NI_[k].R * state.twist_B.head<3>();
    twists.segment<6>(6 * k) << turn,
        state.linearization.T_WB.R * state.twist_B.tail<3>() + T_NI_[k].t.cross(turn);
  }
  return twists;
}

void VisualTerms::beginCalibration(const Window& window) {
  calibration_.H.setZero();
  calibration_.g.setZero();
  calibration_.H_cl.clear();
  calibration_.by_twist.assign(window.states.size(), Matrix6Cd::Zero());
  calibration_.derivatives =
      CalibrationDerivatives(window.calibration.given, window.calibration.now);
}

/** The last landmark's part. It takes most of what the calibration does to its pixels away, so the
 * derivatives that are left are formed before they are multiplied: the difference of the products
 * would be rounding. @param damping that was added to the landmark's diagonal */
void VisualTerms::eliminateFromCalibration(const Eigen::Vector3d& damping) {
  const Eliminated& e = eliminated_.back();
  MatrixC3d H_cl = MatrixC3d::Zero();
  for (const CalibrationSums::Row& row : calibration_.rows)
    H_cl.noalias() += row.weight * row.J_calibration.transpose() * row.J_landmark;
  calibration_.H_cl.push_back(H_cl);
  const Eigen::Matrix<double, 3, kCalibrationSize> follows =
      -e.factor * (e.factor.transpose() * H_cl.transpose());
  Eigen::Matrix<double, 3, 6> G;
  G << hat(e.y), -e.rho * Eigen::Matrix3d::Identity();
  for (const CalibrationSums::Row& row : calibration_.rows) {
    const CalibrationJacobian J = row.J_calibration + row.J_landmark * follows;
    const CalibrationJacobian weighted = row.weight * J;
    calibration_.H.noalias() += weighted.transpose() * J;
    calibration_.g.noalias() += weighted.transpose() * row.r;
    if (row.state == e.landmark->host) continue;
    const Matrix6Cd by_twist = (row.J * G).transpose() * weighted;
    calibration_.by_twist[row.state] += by_twist;
    calibration_.by_twist[e.landmark->host] -= by_twist;
  }
  calibration_.H.noalias() += follows.transpose() * damping.asDiagonal() * follows;
}

void VisualTerms::addCalibration(const Window& window, NormalEquations* equations) {
  // What the twists have with the time offset, whose row in H they fill.
  const Eigen::VectorXd by_time = twistsByTimeOffset(window);
  const Eigen::VectorXd with_time = H_ * by_time;
  calibration_.H(kTimeOffset, kTimeOffset) += by_time.dot(with_time);
  calibration_.g[kTimeOffset] += by_time.dot(g_);
  for (size_t k = 0; k < window.states.size(); ++k) {
    if (!used_[k]) continue;
    Matrix6Cd& H_tc = calibration_.by_twist[k];
    const CalibrationVector row = H_tc.transpose() * by_time.segment<6>(6 * k);
    calibration_.H.row(kTimeOffset) += row.transpose();
    calibration_.H.col(kTimeOffset) += row;
    H_tc.col(kTimeOffset) += with_time.segment<6>(6 * k);
    const Matrix6Cd block = twistByState(window.states[k], centre_W_).transpose() * H_tc;
    const Eigen::Index column = window.states[k].column;
    equations->H.block<6, kCalibrationSize>(column, 0) += block;
    equations->H.block<kCalibrationSize, 6>(0, column) += block.transpose();
  }
  equations->H.topLeftCorner<kCalibrationSize, kCalibrationSize>() += calibration_.H;
  equations->g.head<kCalibrationSize>() += calibration_.g;
}

}  // namespace etalon::fixed_lag
