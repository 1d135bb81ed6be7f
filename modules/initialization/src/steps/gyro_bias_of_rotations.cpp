#include "etalon/initialization/steps/gyro_bias_of_rotations.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** dr_k/d(poses) of all pairs, r_k near zero: 3(N-1) x 6(N-1). */
MatrixXd rotationByPoses(const VisualSolution& visual) {
  const Index n = visual.T_VB.size() - 1;
  MatrixXd J = MatrixXd::Zero(3 * n, 6 * n);
  for (Index k = 0; k < n; ++k) {
    J.block<3, 3>(3 * k, 6 * k).setIdentity();
    if (k > 0)
      J.block<3, 3>(3 * k, 6 * (k - 1)) = -visual.T_VB[k + 1].R.transpose() * visual.T_VB[k].R;
  }
  return J;
}

/** W such that W^T W is the inverse covariance of all r_k; empty if all rows weigh the same. */
MatrixXd rotationWhitening(const VisualSolution& visual,
                           const std::vector<Preintegration>& preintegrations, RowWeights weights) {
  const Index n = preintegrations.size();
  if (weights == RowWeights::kNone) return {};
  MatrixXd covariance = MatrixXd::Zero(3 * n, 3 * n);
  if (weights == RowWeights::kImuAndVision) covariance = covarianceOfRotations(visual);
  for (Index k = 0; k < n; ++k)
    covariance.block<3, 3>(3 * k, 3 * k) += preintegrations[k].covariance().topLeftCorner<3, 3>();
  const Eigen::LLT<MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return {};
  return factor.matrixL().solve(MatrixXd::Identity(3 * n, 3 * n));
}

}  // namespace

MatrixXd covarianceOfRotations(const VisualSolution& visual) {
  const Index n = visual.T_VB.size() - 1;
  if (visual.covariance.rows() != 6 * n) return MatrixXd::Zero(3 * n, 3 * n);
  const MatrixXd J = rotationByPoses(visual);
  return J * visual.covariance * J.transpose();
}

Expected<RotationBias> gyroBiasOfRotations(const InitializationProblem& problem,
                                           const VisualSolution& visual, RowWeights weights,
                                           int passes) {
  RotationBias result;
  result.bias = problem.priors().mean;
  result.preintegrations = problem.preintegrate(result.bias);
  const Index rows = 3 * result.preintegrations.size();
  const MatrixXd whitening = rotationWhitening(visual, result.preintegrations, weights);
  for (int pass = 0; pass < passes; ++pass) {
    MatrixXd J(rows, 3);
    VectorXd r(rows);
    for (size_t k = 0; k < result.preintegrations.size(); ++k) {
      const Preintegration& p = result.preintegrations[k];
      const Matrix3d error =
          p.deltas().dR.transpose() * visual.T_VB[k].R.transpose() * visual.T_VB[k + 1].R;
      const Eigen::Quaterniond q(error);
      J.middleRows<3>(3 * k) = p.dR_dbg();
      r.segment<3>(3 * k) = (q.w() < 0 ? -2.0 : 2.0) * q.vec();
    }
    if (whitening.size() > 0) {
      J = whitening * J;
      r = whitening * r;
    }
    const ScaledCholesky factor(J.transpose() * J);
    if (!factor.determined() || !r.allFinite())
      return refuse(RefusalStatus::kIllConditioned, "the rotations of ",
                    Value(problem.keyframeCount()), " keyframes do not determine the gyro bias");
    result.response = factor.solve(J.transpose());
    const Vector3d step = result.response * r;
    if (whitening.size() > 0) result.response *= whitening;
    result.bias.gyro += step;
    for (Preintegration& p : result.preintegrations) p = p.reintegrated(result.bias);
    constexpr double kStandsStill = 1e-6;  // rad/s
    if (step.norm() < kStandsStill) break;
  }
  return result;
}

VisualFrameEstimate RotationBias::estimate(const InitializationProblem& problem,
                                           const VisualSolution& visual) const {
  VisualFrameEstimate result;
  result.T_VB = visual.T_VB;
  result.landmarks = visual.landmarks;
  result.bias = bias;
  const Index n = preintegrations.size();
  if (visual.covariance.rows() != 6 * n) return result;
  StateErrors errors{ErrorSources(problem, preintegrations), {}};
  errors.poses = errors.sources.poses();
  MatrixXd rotations = rotationByPoses(visual) * errors.poses;
  const MatrixXd imu = errors.sources.imu();
  for (Index k = 0; k < n; ++k) rotations.middleRows<3>(3 * k) -= imu.middleRows<3>(9 * k);
  errors.map = errors.sources.priorMean();
  errors.map.topRows<3>() = response * rotations;
  result.errors = std::move(errors);
  return result;
}

}  // namespace etalon
