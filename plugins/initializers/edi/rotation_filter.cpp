#include "rotation_filter.h"

#include <Eigen/LU>

#include "etalon/core/so3.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

namespace {

/** One run of the filter around a trajectory. */
struct Filter {
  Vector6d error;  ///< [theta, db_g], of the trajectory
  Matrix6d P = Matrix6d::Zero();
  MatrixXd map;  ///< of the estimate's own error, by its sources; empty: not followed
  std::vector<Matrix3d> R_VB;
  std::vector<MatrixXd> rotation_errors;

  Filter(const BiasPriors& priors, const Vector3d& gyro_bias, const Matrix3d& R_first,
         const ErrorSources* sources)
      : R_VB{R_first} {
    error << Vector3d::Zero(), priors.mean.gyro - gyro_bias;
    P.bottomRightCorner<3, 3>().diagonal().setConstant(priors.sigma_gyro_rps *
                                                       priors.sigma_gyro_rps);
    if (!sources) return;
    map = sources->priorMean();
    map.bottomRows<3>() = map.topRows<3>().eval();
    map.topRows<3>().setZero();
  }

  /** @param imu 3 rows, errors of dR */
  void predict(const Preintegration& p, double walk_density, const MatrixXd& imu) {
    Matrix6d F = Matrix6d::Identity();
    F.topLeftCorner<3, 3>() = p.deltas().dR.transpose();
    F.topRightCorner<3, 3>() = p.dR_dbg();
    error = F * error;
    P = F * P * F.transpose();
    P.topLeftCorner<3, 3>() += p.covariance().topLeftCorner<3, 3>();
    P.bottomRightCorner<3, 3>().diagonal().array() += walk_density * walk_density * p.dt();
    if (map.size() == 0) return;
    map = (F * map).eval();
    map.topRows<3>() += imu;
  }

  /** @param vision 3 rows, errors of R_vision */
  void update(const Matrix3d& R_nominal, const Matrix3d& R_vision, const Matrix3d& noise,
              const MatrixXd& vision) {
    const Matrix3d S = P.topLeftCorner<3, 3>() + noise;
    const Eigen::Matrix<double, 6, 3> K = P.leftCols<3>() * S.inverse();
    error += K * (logSO3(R_nominal.transpose() * R_vision) - error.head<3>());
    P -= (K * P.topRows<3>()).eval();
    P = (0.5 * (P + P.transpose())).eval();
    R_VB.push_back(nearestRotation(R_nominal * expSO3(error.head<3>())));
    if (map.size() == 0) return;
    map += K * (vision - map.topRows<3>());
    rotation_errors.emplace_back(map.topRows<3>());
  }
};

}  // namespace

FilteredRotations filterRotations(const InitializationProblem& problem,
                                  const VisualSolution& visual, int passes, double sigma_rad) {
  FilteredRotations result;
  VisualFrameEstimate& estimate = result.estimate;
  estimate.T_VB = visual.T_VB;
  estimate.landmarks = visual.landmarks;
  estimate.bias = problem.priors().mean;
  result.preintegrations = problem.preintegrate(estimate.bias);
  const Index n = result.preintegrations.size();
  const bool known = visual.covariance.rows() == 6 * n;
  for (int pass = 0; pass < passes; ++pass) {
    std::optional<ErrorSources> sources;
    MatrixXd imu, poses;
    if (known) {
      sources.emplace(problem, result.preintegrations);
      imu = sources->imu();
      poses = sources->poses();
    }
    Filter filter(problem.priors(), estimate.bias.gyro, visual.T_VB[0].R,
                  known ? &*sources : nullptr);
    Matrix3d R_nominal = visual.T_VB[0].R;
    for (Index k = 0; k < n; ++k) {
      const Preintegration& p = result.preintegrations[k];
      filter.predict(p, problem.imuNoise().gyro_random_walk,
                     known ? MatrixXd(imu.middleRows<3>(9 * k)) : MatrixXd());
      R_nominal *= p.deltas().dR;
      filter.update(R_nominal, visual.T_VB[k + 1].R,
                    known ? Matrix3d(visual.covariance.block<3, 3>(6 * k, 6 * k))
                          : Matrix3d(sigma_rad * sigma_rad * Matrix3d::Identity()),
                    known ? MatrixXd(poses.middleRows<3>(6 * k)) : MatrixXd());
    }
    const Vector3d change = filter.error.tail<3>();
    estimate.bias.gyro += change;
    for (Preintegration& p : result.preintegrations) p = p.reintegrated(estimate.bias);
    for (Index k = 0; k < n; ++k) estimate.T_VB[k + 1].R = filter.R_VB[k + 1];
    if (known) {
      for (Index k = 0; k < n; ++k) poses.middleRows<3>(6 * k) = filter.rotation_errors[k];
      estimate.errors = StateErrors{*sources, sources->priorMean(), poses};
      estimate.errors->map.topRows<3>() = filter.map.bottomRows<3>();
    }
    constexpr double kStandsStill = 1e-6;  // rad/s
    if (change.norm() < kStandsStill) break;
  }
  return result;
}

}  // namespace etalon::plugins
