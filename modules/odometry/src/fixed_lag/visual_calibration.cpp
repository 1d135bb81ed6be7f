// The columns of the calibration in the pixels' equations.

#include "visual_terms.h"

namespace etalon::fixed_lag {

Eigen::Matrix<double, 6, 1> byTimeOffset(const WindowState& host, const WindowState& target) {
  const SE3 &T_WH = host.linearization.T_WB, &T_WT = target.linearization.T_WB;
  const RelativeJacobians J = relativeJacobians(T_WH * host.T_BI, T_WT * target.T_BI);
  // Both images are later by as much: each moves with its body.
  const auto motion = [](const WindowState& state) {
    Eigen::Matrix<double, 6, 1> m;
    m << state.twist_B.head<3>(), state.linearization.T_WB.R * state.twist_B.tail<3>();
    return m;
  };
  return J.by_target * motion(target) + J.by_host * motion(host);
}

void VisualTerms::beginCalibration(const Window& window) {
  const size_t n = window.states.size();
  calibration_.H.setZero();
  calibration_.g.setZero();
  calibration_.H_cl.clear();
  calibration_.H_host.assign(n * n, Matrix6Cd::Zero());
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
    H_cl.noalias() += row.weight * row.J.transpose() * row.J_landmark;
  calibration_.H_cl.push_back(H_cl);
  const Eigen::Matrix<double, 3, kCalibrationSize> follows = -e.inverse * H_cl.transpose();
  for (const CalibrationSums::Row& row : calibration_.rows) {
    const CalibrationJacobian J = row.J + row.J_landmark * follows;
    const CalibrationJacobian weighted = row.weight * J;
    calibration_.H.noalias() += weighted.transpose() * J;
    calibration_.g.noalias() += weighted.transpose() * row.r;
    if (row.target >= 0)
      calibration_.H_host[e.landmark->host * hosts_.size() + row.target].noalias() +=
          row.J_pose.transpose() * weighted;
  }
  calibration_.H.noalias() += follows.transpose() * damping.asDiagonal() * follows;
}

void VisualTerms::calibrationToAbsolute(const Window& window, int host,
                                        NormalEquations* equations) {
  const HostSums& sums = hosts_[host];
  const WindowState& h = window.states[host];
  Matrix6Cd* H_pc = &calibration_.H_host[static_cast<size_t>(host) * hosts_.size()];
  const std::vector<int>& seen = sums.seen();
  std::vector<Vector6d> by_time(window.states.size());
  for (const int k : seen) by_time[k] = byTimeOffset(h, window.states[k]);
  for (const int k : seen) {
    // What the relative poses have with the time offset, whose row in H they fill.
    Vector6d with_time = Vector6d::Zero();
    for (const int l : seen) {
      if (l >= k)
        with_time.noalias() += sums.H(k, l) * by_time[l];
      else
        with_time.noalias() += sums.H(l, k).transpose() * by_time[l];
    }
    const CalibrationVector row = H_pc[k].transpose() * by_time[k];  // its time offset is zero
    calibration_.H.row(kTimeOffset) += row.transpose();
    calibration_.H.col(kTimeOffset) += row;
    calibration_.H(kTimeOffset, kTimeOffset) += by_time[k].dot(with_time);
    calibration_.g[kTimeOffset] += by_time[k].dot(sums.g(k));
    H_pc[k].col(kTimeOffset) += with_time;
  }
  for (const int k : seen) {
    const RelativeJacobians J = imageJacobians(h, window.states[k]);
    const auto add = [&](Eigen::Index column, const Matrix6d& J_absolute) {
      const Matrix6Cd block = J_absolute.transpose() * H_pc[k];
      equations->H.block<6, kCalibrationSize>(column, 0) += block;
      equations->H.block<kCalibrationSize, 6>(0, column) += block.transpose();
    };
    add(window.states[k].column, J.by_target);
    add(h.column, J.by_host);
  }
}

void VisualTerms::finishCalibration(NormalEquations* equations) const {
  equations->H.topLeftCorner<kCalibrationSize, kCalibrationSize>() += calibration_.H;
  equations->g.head<kCalibrationSize>() += calibration_.g;
}

}  // namespace etalon::fixed_lag
