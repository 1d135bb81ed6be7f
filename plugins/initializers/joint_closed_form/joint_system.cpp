#include "joint_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/world_errors.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Offsets of the unknowns that are left when the landmarks are eliminated. */
enum Unknown : Index { kVelocity = 0, kGyroBias = 3, kAccelBias = 6, kGravity = 9, kUnknowns = 12 };
constexpr int kPose = 6;  ///< [rotation, position] of a node

/** The nodes' errors as a linear function of the unknowns, y = J x + c, with 9 rows a node. */
void linearMotion(const ClosedFormMotion& motion, const std::vector<SE3>& T_VB, MatrixXd* J,
                  VectorXd* c) {
  const Index n = ClosedFormMotion::kError * (motion.nodes.size() - 1);
  J->setZero(n, kUnknowns);
  c->setZero(n);
  for (size_t k = 1; k < motion.nodes.size(); ++k) {
    const ClosedFormMotion::Node& node = motion.nodes[k];
    const Index row = ClosedFormMotion::kError * (k - 1);
    J->block<9, 6>(row, kGyroBias) = node.bias;
    J->block<3, 3>(row + 3, kVelocity).diagonal().setConstant(node.t);
    J->block<3, 3>(row + 3, kGravity).diagonal().setConstant(0.5 * node.t * node.t);
    J->block<3, 3>(row + 6, kVelocity).setIdentity();
    J->block<3, 3>(row + 6, kGravity).diagonal().setConstant(node.t);
    c->segment<3>(row) = logSO3(T_VB[k].R.transpose() * node.R_VB);
    c->segment<3>(row + 3) = node.alpha - T_VB[k].t;
    c->segment<3>(row + 6) = node.beta;
  }
}

/** Selects the rows [rotation, position] of every node's [rotation, position, velocity]. */
MatrixXd poseRows(const MatrixXd& nine) {
  const Index n = nine.rows() / ClosedFormMotion::kError;
  MatrixXd six(kPose * n, nine.cols());
  for (Index k = 0; k < n; ++k)
    six.middleRows<kPose>(kPose * k) = nine.middleRows<kPose>(ClosedFormMotion::kError * k);
  return six;
}

/** @param y9 errors of the nodes' poses against `estimate`, and their velocities themselves */
void adopt(const NormConstrainedSolution& solution, const VectorXd& y9, JointEstimate* estimate) {
  estimate->bias.gyro += solution.x.segment<3>(kGyroBias);
  estimate->bias.accel += solution.x.segment<3>(kAccelBias);
  estimate->g_V = solution.x.tail<3>();
  estimate->v_VB.assign(1, solution.x.segment<3>(kVelocity));
  for (size_t k = 1; k < estimate->T_VB.size(); ++k) {
    const Index row = ClosedFormMotion::kError * (k - 1);
    SE3& pose = estimate->T_VB[k];
    pose.R = nearestRotation(pose.R * expSO3(y9.segment<3>(row)));
    pose.t += y9.segment<3>(row + 3);
    estimate->v_VB.emplace_back(y9.segment<3>(row + 6));
  }
  const Eigen::Matrix<double, 3, 2> B = tangentBasis(estimate->g_V);
  const Eigen::Matrix2d information =
      estimate->g_V.squaredNorm() * B.transpose() * solution.A_g * B;
  const double trace = information.trace(), determinant = information.determinant();
  const double least = 0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4.0 * determinant)));
  estimate->sigma_gravity = 1.0 / std::sqrt(std::max(least, 1e-300));
}

}  // namespace

JointSystem::JointSystem(const InitializationProblem& problem, const ClosedFormMotion& motion,
                         const MatrixXd& S, const VectorXd& s, const JointEstimate& estimate,
                         bool imu_noise, bool estimate_accel_bias)
    : gravity_mps2_(problem.gravityMagnitude()), imu_noise_(imu_noise), S_(S), s_(s), W_(S) {
  linearMotion(motion, estimate.T_VB, &J9_, &c9_);
  const MatrixXd J = poseRows(J9_);
  const VectorXd c = poseRows(c9_);
  VectorXd w = s;
  if (imu_noise) {  // (S^-1 + Sigma)^-1 = (I + S Sigma)^-1 S, which does not need S^-1
    noise_y_ = poseRows(motion.covariance);
    last_noise_ = motion.covariance.bottomRightCorner<3, 3>();
    MatrixXd M = S * poseRows(noise_y_.transpose());
    M.diagonal().array() += 1.0;
    whitening_.compute(M);
    W_ = whitening_.solve(S);
    w = whitening_.solve(s);
  }
  const BiasPriors& priors = problem.priors();
  H_ = J.transpose() * W_ * J;
  b_ = J.transpose() * (w - W_ * c);
  const double gyro = 1.0 / (priors.sigma_gyro_rps * priors.sigma_gyro_rps);
  // A fixed b_a has a prior so strong that nothing moves it.
  const double accel =
      estimate_accel_bias ? 1.0 / (priors.sigma_accel_mps2 * priors.sigma_accel_mps2) : 1e18;
  H_.diagonal().segment<3>(kGyroBias).array() += gyro;
  H_.diagonal().segment<3>(kAccelBias).array() += accel;
  b_.segment<3>(kGyroBias) += gyro * (priors.mean.gyro - estimate.bias.gyro);
  b_.segment<3>(kAccelBias) += accel * (priors.mean.accel - estimate.bias.accel);
  H_ = (0.5 * (H_ + H_.transpose())).eval();
}

bool JointSystem::solve(JointEstimate* estimate) const {
  const NormConstrainedSolution solution = solveNormConstrained(H_, b_, gravity_mps2_);
  if (!solution.summary.usable()) return false;
  VectorXd y9 = J9_ * solution.x + c9_;
  if (imu_noise_) {
    const VectorXd y = poseRows(y9);
    y9 += noise_y_.transpose() * whitening_.solve(s_ - S_ * y);
  }
  adopt(solution, y9, estimate);
  return true;
}

MatrixXd JointSystem::covariance(const JointEstimate& estimate) const {
  // Gravity moves in its tangent plane: x = T x', 12 x 11.
  MatrixXd T = MatrixXd::Zero(kUnknowns, kUnknowns - 1);
  T.topLeftCorner<9, 9>().setIdentity();
  T.bottomRightCorner<3, 2>() = gravity_mps2_ * tangentBasis(estimate.g_V);
  const Eigen::LLT<MatrixXd> information(T.transpose() * H_ * T);
  if (information.info() != Eigen::Success) return {};
  const MatrixXd P = T * information.solve(T.transpose());

  // The last node's velocity as a function of x, and the noise of it that the tracks leave.
  MatrixXd last = J9_.bottomRows<3>();
  Matrix3d left = Matrix3d::Zero();
  if (imu_noise_) {
    const MatrixXd noise = noise_y_.rightCols<3>();  // of the last velocity
    last -= noise.transpose() * W_ * poseRows(J9_);
    left = last_noise_ - noise.transpose() * W_ * noise;
  }
  MatrixXd G = MatrixXd::Zero(12, kUnknowns);  // [b_g, b_a, g, last velocity]
  G.block<6, 6>(0, kGyroBias).setIdentity();
  G.block<3, 3>(6, kGravity).setIdentity();
  G.bottomRows<3>() = last;
  Eigen::Matrix<double, 12, 12> in_V = G * P * G.transpose();
  in_V.bottomRightCorner<3, 3>() += left;
  const Matrix3d R_WV = rotationBetween(estimate.g_V, -Vector3d::UnitZ());
  return covarianceInWorld(in_V, R_WV, R_WV * estimate.v_VB.back(), gravity_mps2_);
}

}  // namespace etalon::plugins
