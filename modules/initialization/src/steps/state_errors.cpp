#include "etalon/initialization/steps/state_errors.h"

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/world_errors.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

ErrorSources::ErrorSources(const InitializationProblem& problem,
                           const std::vector<Preintegration>& preintegrations,
                           const GyroBiasErrors& measured_gyro_bias)
    : ErrorSources(problem, preintegrations, problem.visualSolution()->covariance,
                   measured_gyro_bias) {}

ErrorSources::ErrorSources(const InitializationProblem& problem,
                           const std::vector<Preintegration>& preintegrations,
                           const MatrixXd& poses, const GyroBiasErrors& measured_gyro_bias)
    : intervals_(preintegrations.size()), gyro_bias_by_rotations_(measured_gyro_bias.by_rotations) {
  const Index n = 15 * intervals_ + 9;
  covariance_ = MatrixXd::Zero(n, n);
  covariance_.topLeftCorner(6 * intervals_, 6 * intervals_) = poses;
  for (Index k = 0; k < intervals_; ++k)
    covariance_.block<9, 9>(6 * intervals_ + 9 * k, 6 * intervals_ + 9 * k) =
        preintegrations[k].covariance9();
  const BiasPriors& priors = problem.priors();
  covariance_.diagonal().segment<3>(n - 9).setConstant(priors.sigma_gyro_rps *
                                                       priors.sigma_gyro_rps);
  covariance_.diagonal().segment<3>(n - 6).setConstant(priors.sigma_accel_mps2 *
                                                       priors.sigma_accel_mps2);
  covariance_.bottomRightCorner<3, 3>() = measured_gyro_bias.covariance;
}

MatrixXd ErrorSources::select(Index first, Index rows) const {
  MatrixXd map = MatrixXd::Zero(rows, covariance_.cols());
  map.middleCols(first, rows).setIdentity();
  return map;
}

MatrixXd ErrorSources::measuredGyroBias() const {
  MatrixXd errors = select(15 * intervals_ + 6, 3);
  for (size_t k = 0; k < gyro_bias_by_rotations_.size(); ++k)
    errors.middleCols<3>(6 * intervals_ + 9 * static_cast<Index>(k)) = gyro_bias_by_rotations_[k];
  return errors;
}

MatrixXd StateErrors::covariance(const Matrix3d& R_WV, const Vector3d& v_WB,
                                 double gravity_mps2) const {
  MatrixXd errors(12 + poses.rows(), map.cols());
  errors.topRows<9>() = map.topRows<9>();
  errors.middleRows<3>(9) = map.bottomRows<3>();
  if (poses.size() > 0) errors.bottomRows(poses.rows()) = poses;
  return covarianceInWorld(sources.covarianceOf(errors), R_WV, v_WB, gravity_mps2);
}

std::optional<StateErrors> inertialOnlyErrors(const InitializationProblem& problem,
                                              const std::vector<Preintegration>& preintegrations,
                                              const InertialOnlyOptions& options,
                                              const InertialOnlyResult& result,
                                              const GyroBiasErrors& measured_gyro_bias) {
  const VisualSolution& visual = *problem.visualSolution();
  if (visual.covariance.rows() != 6 * static_cast<Index>(preintegrations.size())) return {};
  const InertialOnlyResponse response =
      inertialOnlyResponse(visual.T_VB, preintegrations, options, result);
  if (response.by_residuals.size() == 0) return {};
  StateErrors errors{ErrorSources(problem, preintegrations, measured_gyro_bias), {}};
  const ErrorSources& sources = errors.sources;
  errors.poses = sources.poses();
  const MatrixXd solution =
      response.by_residuals * (response.residuals_by_poses * sources.poses() - sources.imu()) +
      response.by_prior_mean * sources.priorMean() +
      response.by_gyro_bias * sources.measuredGyroBias();
  errors.map.resize(solution.rows() + 1, solution.cols());
  errors.map.topRows<6>() = solution.topRows<6>();
  errors.map.middleRows<3>(StateErrors::kGravity) =
      options.gravity_mps2 * tangentBasis(result.g_V) * solution.middleRows<2>(6);
  errors.map.bottomRows(solution.rows() - 8) = solution.bottomRows(solution.rows() - 8);
  return errors;
}

MatrixXd rowErrors(const LinearAlignmentRows& rows, const ErrorSources& sources,
                   const MatrixXd& pose_errors, const MatrixXd& bias_errors) {
  const MatrixXd imu = sources.imu();
  MatrixXd errors = rows.by_poses * pose_errors - rows.by_bias * bias_errors;
  for (Index k = 0; k < imu.rows() / 9; ++k)
    errors.middleRows<6>(6 * k) -= imu.middleRows<6>(9 * k + 3);
  return errors;
}

bool alignErrors(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& preintegrations,
                 const ImuBias& bias, const LinearAlignmentOptions& options, const Vector3d& g_V,
                 const MatrixXd& pose_errors, StateErrors* errors) {
  const LinearAlignmentResponse response =
      linearAlignmentResponse(T_VB, preintegrations, bias, options, g_V);
  if (response.by_rows.size() == 0) return false;
  const MatrixXd biases = errors->map.topRows<6>();
  const MatrixXd solution =
      response.by_rows * rowErrors(response.rows, errors->sources, pose_errors, biases);
  errors->map.resize(6 + solution.rows(), solution.cols());
  errors->map << biases, solution.bottomRows<3>(), solution.topRows(solution.rows() - 3);
  return true;
}

}  // namespace etalon
