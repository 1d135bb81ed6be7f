#include "hand_eye.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/predicted_errors.h"
#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Matrices of q p = L(q) p and p q = R(q) p, coefficients (x, y, z, w). */
Matrix4d left(const Quaterniond& q) {
  Matrix4d L = q.w() * Matrix4d::Identity();
  L.topLeftCorner<3, 3>() += hat(q.vec());
  L.topRightCorner<3, 1>() = q.vec();
  L.bottomLeftCorner<1, 3>() = -q.vec().transpose();
  return L;
}
Matrix4d right(const Quaterniond& q) {
  Matrix4d R = q.w() * Matrix4d::Identity();
  R.topLeftCorner<3, 3>() -= hat(q.vec());
  R.topRightCorner<3, 1>() = q.vec();
  R.bottomLeftCorner<1, 3>() = -q.vec().transpose();
  return R;
}

Quaterniond positive(const Matrix3d& R) {
  Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  return q;
}

/** R_BC that turns the camera's steps into the gyro's. */
Matrix3d startRotation(const std::vector<Preintegration>& pairs,
                       const std::vector<Matrix3d>& R_C_step) {
  MatrixXd M(4 * pairs.size(), 4);
  for (size_t k = 0; k < pairs.size(); ++k)
    M.middleRows<4>(4 * k) = left(positive(pairs[k].deltas().dR)) - right(positive(R_C_step[k]));
  const Eigen::JacobiSVD<MatrixXd> svd(M, Eigen::ComputeFullV);
  const Eigen::Vector4d q = svd.matrixV().col(3);
  return Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
}

/** dr/d(poses): the attitudes of stereo odometry in the body that the calibration has, turned into
 * the body that is found. 3(N-1) x 6(N-1). */
MatrixXd residualsByPoses(const VisualSolution& visual, const Matrix3d& R_found_known) {
  const Index n = visual.T_VB.size() - 1;
  MatrixXd J = MatrixXd::Zero(3 * n, 6 * n);
  for (Index k = 0; k < n; ++k) {
    J.block<3, 3>(3 * k, 6 * k) = R_found_known;
    if (k > 0)
      J.block<3, 3>(3 * k, 6 * (k - 1)) =
          -R_found_known * visual.T_VB[k + 1].R.transpose() * visual.T_VB[k].R;
  }
  return J;
}

}  // namespace

std::optional<HandEye> solveHandEye(const InitializationProblem& problem,
                                    const VisualSolution& visual, bool weighted, int passes) {
  const Matrix3d known = problem.calibration().cameras[0].T_BC.R;
  HandEye result;
  result.bias = problem.priors().mean;
  result.preintegrations = problem.preintegrate(result.bias);
  std::vector<Preintegration>& pairs = result.preintegrations;
  const Index n = pairs.size();
  if (n < 2) return std::nullopt;
  std::vector<Matrix3d> R_C_step;
  for (Index k = 0; k < n; ++k)
    R_C_step.emplace_back(known.transpose() * visual.T_VB[k].R.transpose() * visual.T_VB[k + 1].R *
                          known);
  result.R_BC = startRotation(pairs, R_C_step);

  const bool has_covariance = visual.covariance.rows() == 6 * n;
  MatrixXd response;
  VectorXd r(3 * n);
  for (int pass = 0; pass < passes; ++pass) {
    MatrixXd M(3 * n, 6), by_imu = MatrixXd::Zero(3 * n, 3 * n);
    for (Index k = 0; k < n; ++k) {
      const Matrix3d step = result.R_BC * R_C_step[k] * result.R_BC.transpose();
      r.segment<3>(3 * k) = logSO3(pairs[k].deltas().dR.transpose() * step);
      M.block<3, 3>(3 * k, 0) = pairs[k].dR_dbg();
      M.block<3, 3>(3 * k, 3) = Matrix3d::Identity() - step.transpose();
      by_imu.block<3, 3>(3 * k, 3 * k) = pairs[k].covariance().topLeftCorner<3, 3>();
    }
    MatrixXd whitening = MatrixXd::Identity(3 * n, 3 * n);
    if (weighted && has_covariance) {
      const MatrixXd J = residualsByPoses(visual, result.R_BC * known.transpose());
      const Eigen::LLT<MatrixXd> noise(J * visual.covariance * J.transpose() + by_imu);
      if (noise.info() == Eigen::Success) whitening = noise.matrixL().solve(whitening);
    }
    const MatrixXd A = whitening * M;
    const MatrixXd AtA = A.transpose() * A;
    const ScaledCholesky factor(AtA);
    // Turns about one axis of the body leave its column empty but for rounding, which scaling lifts.
    const Vector3d rotation = AtA.diagonal().tail<3>();
    if (!factor.determined() || rotation.minCoeff() < 1e-15 * rotation.maxCoeff())
      return std::nullopt;
    response = factor.solve(A.transpose()) * whitening;
    if (!response.allFinite()) return std::nullopt;
    const VectorXd change = response * r;
    result.bias.gyro += change.head<3>();
    result.R_BC = nearestRotation(expSO3(change.tail<3>()) * result.R_BC);
    for (Preintegration& p : pairs) p = p.reintegrated(result.bias);
    const double mean_square = (r - M * change).squaredNorm() / std::max<Index>(1, 3 * n - 6);
    const Matrix3d variance =
        mean_square * (response * response.transpose()).bottomRightCorner<3, 3>();
    result.sigma_rotation = largestSigma(variance);
    constexpr double kStandsStill = 1e-8;
    if (change.norm() < kStandsStill) break;
  }
  if (!has_covariance) return result;
  StateErrors errors{ErrorSources(problem, pairs), {}};
  MatrixXd of_r =
      residualsByPoses(visual, result.R_BC * known.transpose()) * errors.sources.poses();
  const MatrixXd imu = errors.sources.imu();
  for (Index k = 0; k < n; ++k) of_r.middleRows<3>(3 * k) -= imu.middleRows<3>(9 * k);
  const MatrixXd solution = response * of_r;
  errors.map = errors.sources.priorMean();
  errors.map.topRows<3>() = solution.topRows<3>();
  result.rotation_errors = solution.bottomRows<3>();
  result.errors = std::move(errors);
  return result;
}

}  // namespace etalon::plugins
