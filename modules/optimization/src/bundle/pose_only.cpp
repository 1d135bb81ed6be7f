#include "etalon/optimization/bundle/pose_only.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {

PoseOnlyResult solvePoseOnly(const std::array<SE3, 2>& T_CB,
                             const std::vector<PointMeasurement>& measurements, const SE3& T_WB,
                             const PoseOnlyOptions& options) {
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  const double huber = std::sqrt(options.chi2_threshold);
  PoseOnlyResult result;
  result.T_WB = T_WB;
  result.inlier.assign(measurements.size(), 1);
  for (int round = 0; round < options.rounds; ++round) {
    const bool robust = round + 1 < options.rounds;
    for (int iteration = 0; iteration < options.iterations_per_round; ++iteration) {
      Matrix6d H = Matrix6d::Zero();
      Vector6d b = Vector6d::Zero();
      for (size_t i = 0; i < measurements.size(); ++i) {
        if (!result.inlier[i]) continue;
        const PointMeasurement& m = measurements[i];
        Eigen::Vector2d r;
        Eigen::Matrix<double, 2, 6> J;
        if (!reprojectionResidual(T_CB[static_cast<size_t>(m.camera)], m.measurement, result.T_WB,
                                  m.p_W, &r, &J))
          continue;
        const double norm = r.norm();
        const double weight = robust && norm > huber ? huber / norm : 1.0;
        H.noalias() += weight * J.transpose() * J;
        b.noalias() += weight * J.transpose() * r;
      }
      const Eigen::LDLT<Matrix6d> factor(H);
      const Vector6d step = factor.solve(-b);
      result.converged = factor.isPositive() && factor.rcond() > 1e-14 && step.allFinite();
      if (!result.converged) break;
      result.T_WB.R = result.T_WB.R * expSO3(step.head<3>());
      result.T_WB.t += step.tail<3>();
      if (step.squaredNorm() < 1e-14) break;
    }
    // The threshold narrows from round to round: the first pose may be far off.
    const double threshold = options.chi2_threshold * std::pow(4.0, options.rounds - 1 - round);
    result.inliers = 0;
    for (size_t i = 0; i < measurements.size(); ++i) {
      const PointMeasurement& m = measurements[i];
      Eigen::Vector2d r;
      result.inlier[i] = reprojectionResidual(T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                              result.T_WB, m.p_W, &r) &&
                         r.squaredNorm() < threshold;
      result.inliers += result.inlier[i];
    }
    if (!result.converged || result.inliers < 6) {
      result.converged = false;
      break;
    }
  }
  result.T_WB.R = nearestRotation(result.T_WB.R);
  return result;
}

}  // namespace etalon
