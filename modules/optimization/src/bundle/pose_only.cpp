#include "etalon/optimization/bundle/pose_only.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/huber.h"

namespace etalon {

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/** Gauss-Newton with relabelling between its rounds. */
class PoseOnlySolver {
 public:
  PoseOnlySolver(const std::array<SE3, 2>& T_CB, const std::vector<PointMeasurement>& measurements,
                 PoseOnlyResult* result)
      : T_CB_(T_CB), measurements_(measurements), result_(*result) {}

  /** One step; `*length_2` receives its square. @return false if the system is singular */
  bool step(double huber, double* length_2) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    double cost = 0.0;
    for (size_t i = 0; i < measurements_.size(); ++i) {
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 6> J;
      if (!result_.inlier[i] || !residual(measurements_[i], &r, &J)) continue;
      const double norm = r.norm(), weight = huberWeight(norm, huber);
      H.noalias() += weight * J.transpose() * J;
      b.noalias() += weight * J.transpose() * r;
      cost += huberLoss(norm, huber);
    }
    if (result_.summary.iterations++ == 0) result_.summary.initial_cost = cost;
    const Eigen::LDLT<Matrix6d> factor(H);
    const Vector6d step = factor.solve(-b);
    if (!(factor.isPositive() && factor.rcond() > 1e-14 && step.allFinite())) return false;
    result_.T_WB.R = result_.T_WB.R * expSO3(step.head<3>());
    result_.T_WB.t += step.tail<3>();
    *length_2 = step.squaredNorm();
    return true;
  }

  void relabel(double chi2_threshold) {
    result_.inliers = 0;
    result_.summary.final_cost = 0.0;
    for (size_t i = 0; i < measurements_.size(); ++i) {
      Eigen::Vector2d r;
      result_.inlier[i] =
          residual(measurements_[i], &r, nullptr) && r.squaredNorm() < chi2_threshold;
      if (!result_.inlier[i]) continue;
      ++result_.inliers;
      result_.summary.final_cost += 0.5 * r.squaredNorm();
    }
  }

 private:
  bool residual(const PointMeasurement& m, Eigen::Vector2d* r,
                Eigen::Matrix<double, 2, 6>* J) const {
    return reprojectionResidual(T_CB_[m.camera], m.measurement, result_.T_WB, m.p_W, r, J);
  }

  const std::array<SE3, 2>& T_CB_;
  const std::vector<PointMeasurement>& measurements_;
  PoseOnlyResult& result_;
};

}  // namespace

PoseOnlyResult solvePoseOnly(const std::array<SE3, 2>& T_CB,
                             const std::vector<PointMeasurement>& measurements, const SE3& T_WB,
                             const PoseOnlyOptions& options) {
  PoseOnlyResult result;
  result.T_WB = T_WB;
  result.inlier.assign(measurements.size(), 1);
  PoseOnlySolver solver(T_CB, measurements, &result);
  constexpr double kConvergedStep2 = 1e-14;
  constexpr int kFewestInliers = 6;
  SolverSummary& summary = result.summary;
  for (int round = 0; round < options.rounds; ++round) {
    const bool last = round + 1 == options.rounds;
    const double huber =
        last ? std::numeric_limits<double>::infinity() : std::sqrt(options.chi2_threshold);
    summary.termination = Termination::kMaxIterations;
    for (int iteration = 0; iteration < options.iterations_per_round; ++iteration) {
      double length_2 = 0.0;
      if (!solver.step(huber, &length_2)) {
        summary.stop(Termination::kSingular, "the points do not determine the pose");
        break;
      }
      if (length_2 >= kConvergedStep2) continue;
      summary.termination = Termination::kConverged;
      break;
    }
    // The threshold narrows from round to round: the first pose may be far off.
    solver.relabel(options.chi2_threshold * std::pow(4.0, options.rounds - 1 - round));
    if (!summary.usable()) break;
    if (result.inliers < kFewestInliers) {
      summary.stop(Termination::kFailed, "fewer than six measurements agree with the pose");
      break;
    }
  }
  result.T_WB.R = nearestRotation(result.T_WB.R);
  return result;
}

}  // namespace etalon
