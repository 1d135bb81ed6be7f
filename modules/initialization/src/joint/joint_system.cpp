#include "etalon/initialization/joint/joint_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/initialization/steps/world_errors.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** The unknowns that are left when the landmarks are eliminated; gravity last. */
enum Unknown : Index { kVelocity = 0, kGyroBias = 3, kAccelBias = 6, kGravity = 9, kUnknowns = 12 };
constexpr int kPose = 6;  ///< [rotation, position] of a node

/** The nodes' errors, against T_SS, as a linear function of the unknowns: y = J x + c, 9 a node. */
void linearMotion(const ClosedFormMotion& motion, const std::vector<SE3>& T_SS, MatrixXd* J,
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
    c->segment<3>(row) = logSO3(T_SS[k].R.transpose() * node.R_VB);
    c->segment<3>(row + 3) = node.alpha - T_SS[k].t;
    c->segment<3>(row + 6) = node.beta;
  }
}

/** Rows [rotation, position] of every node's [rotation, position, velocity]. */
MatrixXd poseRows(const MatrixXd& nine) {
  const Index n = nine.rows() / ClosedFormMotion::kError;
  MatrixXd six(kPose * n, nine.cols());
  for (Index k = 0; k < n; ++k)
    six.middleRows<kPose>(kPose * k) = nine.middleRows<kPose>(ClosedFormMotion::kError * k);
  return six;
}

/** What the cameras see turned. */
struct SeenErrors {
  MatrixXd covariance;  ///< of [rotation, position] of the nodes, relative to the first
  MatrixXd with_first;  ///< of the first node's turn with those, 3 rows
};

/** Node k is seen turned by e_k, which is an error of its own and the cameras' turn, the same for
 * all: relative to the first node as it is seen, that moves rotation k by e_k - R_k^T e_0 and
 * position k by p_k x e_0. */
SeenErrors seenErrors(const std::vector<SE3>& T_VB, const JointModel& model) {
  const Index n = T_VB.size() - 1;
  MatrixXd by_first(kPose * n, 3);
  for (Index k = 0; k < n; ++k)
    by_first.middleRows<kPose>(kPose * k) << -T_VB[k + 1].R.transpose(), hat(T_VB[k + 1].t);
  MatrixXd by_turn = by_first;
  for (Index k = 0; k < n; ++k) by_turn.block<3, 3>(kPose * k, 0).diagonal().array() += 1.0;
  const double own = model.sigma_shared_rad * model.sigma_shared_rad;
  const double turn = model.sigma_turn_rad * model.sigma_turn_rad;
  SeenErrors errors;
  errors.with_first = (own * by_first + turn * by_turn).transpose();
  errors.covariance = own * by_first * by_first.transpose();
  errors.covariance.noalias() += turn * by_turn * by_turn.transpose();
  for (Index k = 0; k < n; ++k)
    errors.covariance.block<3, 3>(kPose * k, kPose * k).diagonal().array() += own;
  return errors;
}

/** Whether S + Sigma^-1 is positive definite. */
bool hasMinimum(const MatrixXd& S, const MatrixXd& sigma) {
  const MatrixXd root = Eigen::LLT<MatrixXd>(sigma).matrixL();
  MatrixXd whitened = root.transpose() * S * root;
  whitened.diagonal().array() += 1.0;
  return Eigen::LLT<MatrixXd>(whitened).info() == Eigen::Success;
}

/** T moved by [rotation, position]. */
SE3 moved(const SE3& T, const Eigen::Ref<const VectorXd>& step) {
  return {nearestRotation(T.R * expSO3(step.head<3>())), T.t + step.segment<3>(3)};
}

/** @param y9 the nodes' errors against T_SS, velocities as they are @param seen the same of the
 * poses as the cameras see them, 6 a node */
void adopt(const NormConstrainedSolution& solution, const VectorXd& y9, const VectorXd& seen,
           JointEstimate* estimate) {
  estimate->bias.gyro += solution.x.segment<3>(kGyroBias);
  estimate->bias.accel += solution.x.segment<3>(kAccelBias);
  estimate->g_V = solution.x.tail<3>();
  estimate->v_VB.assign(1, solution.x.segment<3>(kVelocity));
  for (size_t k = 1; k < estimate->T_VB.size(); ++k) {
    const Index row = ClosedFormMotion::kError * (k - 1);
    SE3& T_SS = estimate->T_SS[k];
    estimate->T_VB[k] = moved(T_SS, y9.segment<kPose>(row));
    T_SS = moved(T_SS, seen.segment<kPose>(kPose * (k - 1)));
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
                         const JointModel& model)
    : gravity_mps2_(problem.gravityMagnitude()), imu_noise_(model.imu_noise), S_(S), s_(s), W_(S) {
  linearMotion(motion, estimate.T_SS, &J9_, &c9_);
  const MatrixXd J = poseRows(J9_);
  const VectorXd c = poseRows(c9_);
  VectorXd w = s;
  if (imu_noise_) {  // (S^-1 + Sigma)^-1 = (I + S Sigma)^-1 S, which does not need S^-1
    noise_y_ = poseRows(motion.covariance);
    noise_ = motion.covariance;
    if (motion.slow_covariance.size() > 0) {
      slow_accel_ = model.slow_accel;
      slow_ = poseRows(poseRows(motion.slow_covariance).transpose());
      white_root_ = motion.white_accel_root;
    }
    sigma_ = poseRows(noise_y_.transpose());
    SeenErrors seen = seenErrors(estimate.T_VB, model);
    sigma_ += seen.covariance;
    first_seen_ = std::move(seen.with_first);
    MatrixXd M = S * sigma_;
    M.diagonal().array() += 1.0;
    whitening_.compute(M);
    W_ = whitening_.solve(S);
    w = whitening_.solve(s);
  }
  const BiasPriors& priors = problem.priors();
  H_ = J.transpose() * W_ * J;
  b_ = J.transpose() * (w - W_ * c);
  const double gyro = 1.0 / (priors.sigma_gyro_rps * priors.sigma_gyro_rps);
  // Fixed is a prior so strong that nothing moves it.
  const double accel =
      model.estimate_accel_bias ? 1.0 / (priors.sigma_accel_mps2 * priors.sigma_accel_mps2) : 1e18;
  H_.diagonal().segment<3>(kGyroBias).array() += gyro;
  H_.diagonal().segment<3>(kAccelBias).array() += accel;
  b_.segment<3>(kGyroBias) += gyro * (priors.mean.gyro - estimate.bias.gyro);
  b_.segment<3>(kAccelBias) += accel * (priors.mean.accel - estimate.bias.accel);
  H_ = (0.5 * (H_ + H_.transpose())).eval();
}

bool JointSystem::solve(JointEstimate* estimate) const {
  const NormConstrainedSolution solution = solveNormConstrained(H_, b_, gravity_mps2_);
  if (!solution.summary.usable()) return false;
  if (slow_.size() > 0) followSizes(solution.x, estimate);
  VectorXd y9 = J9_ * solution.x + c9_;
  VectorXd seen = poseRows(y9);
  if (imu_noise_) {
    const VectorXd pull = whitening_.solve(s_ - S_ * seen);
    y9 += noise_y_.transpose() * pull;
    seen += sigma_ * pull;
    estimate->R_VS = expSO3(first_seen_ * pull);
  }
  estimate->step_sigmas =
      std::sqrt(std::max(0.0, seen.dot(S_ * seen)) / static_cast<double>(seen.size()));
  adopt(solution, y9, seen, estimate);
  return true;
}

MatrixXd JointSystem::tangent(const Vector3d& g) const {
  MatrixXd T = tangentUnknowns(kGravity, g);
  T.rightCols<2>() *= gravity_mps2_;
  return T;
}

/** With r = S^-1 s - c, of covariance V = S^-1 + Sigma on top of what the unknowns explain, and
 * P = V^-1 - V^-1 J (J^T V^-1 J)^-1 J^T V^-1, C_i a part of Sigma and t_i the logarithm of its
 * factor: d(-2 log L)/dt_i = tr(P C_i) - r^T P C_i P r, of covariance 2 tr(P C_i P C_j). Of an
 * interval's white noise C_i = L_i L_i^T. */
void JointSystem::followSizes(const VectorXd& x, JointEstimate* estimate) const {
  constexpr Index kWhite = 6;  // columns of an interval
  const MatrixXd J = poseRows(J9_), T = tangent(x.tail<3>()), WJ = W_ * J * T;
  const Eigen::LLT<MatrixXd> unknowns(T.transpose() * H_ * T);
  if (unknowns.info() != Eigen::Success) return;
  const VectorXd Pr = whitening_.solve(s_) - W_ * (poseRows(c9_) + J * x);
  MatrixXd P = W_;
  P.noalias() -= WJ * unknowns.solve(WJ.transpose());

  const Index intervals = white_root_.cols() / kWhite;
  std::vector<Index> positions;
  for (Index k = 0; k < intervals; ++k)
    for (Index i = 3; i < kPose; ++i) positions.push_back(kPose * k + i);
  const MatrixXd PC = P * slow_, PL = P(Eigen::all, positions) * white_root_, CPL = slow_ * PL;
  const MatrixXd LPL = white_root_.transpose() * PL(positions, Eigen::all);
  const VectorXd LPr = white_root_.transpose() * Pr(positions);
  VectorXd score(1 + intervals);
  MatrixXd information(1 + intervals, 1 + intervals);
  score(0) = 0.5 * (Pr.dot(slow_ * Pr) - PC.trace());
  information(0, 0) = 0.5 * PC.cwiseProduct(PC.transpose()).sum();
  for (Index k = 0; k < intervals; ++k) {
    const Index column = kWhite * k;
    score(1 + k) = 0.5 * (LPr.segment<kWhite>(column).squaredNorm() -
                          LPL.diagonal().segment<kWhite>(column).sum());
    information(0, 1 + k) = information(1 + k, 0) =
        0.5 * PL.middleCols<kWhite>(column).cwiseProduct(CPL.middleCols<kWhite>(column)).sum();
    for (Index l = 0; l < intervals; ++l)
      information(1 + k, 1 + l) = 0.5 * LPL.block<kWhite, kWhite>(column, kWhite * l).squaredNorm();
  }
  estimate->sizes = scoredSizes(estimate->sizes, score, information, slow_accel_);
}

MatrixXd JointSystem::covariance(const JointEstimate& estimate,
                                 const std::vector<size_t>& keyframes,
                                 const MatrixXd& excess) const {
  if (imu_noise_ && !hasMinimum(S_, sigma_)) return {};
  const MatrixXd T = tangent(estimate.g_V);
  const Eigen::LLT<MatrixXd> information(T.transpose() * H_ * T);
  if (information.info() != Eigen::Success) return {};
  const MatrixXd P = T * information.solve(T.transpose());

  // The last node's velocity and the keyframes' poses by x, and what of their noise is left.
  std::vector<Index> rows;
  for (Index i = 0; i < 3; ++i) rows.push_back(J9_.rows() - 3 + i);
  for (size_t k = 1; k < keyframes.size(); ++k)
    for (Index i = 0; i < kPose; ++i)
      rows.push_back(ClosedFormMotion::kError * static_cast<Index>(keyframes[k] - 1) + i);
  MatrixXd by_x = J9_(rows, Eigen::all), left = MatrixXd::Zero(by_x.rows(), by_x.rows());
  MatrixXd by_gradient = MatrixXd::Zero(9 + by_x.rows(), S_.rows());  // of the poses
  if (imu_noise_) {
    const MatrixXd noise = noise_y_(Eigen::all, rows), weighted = noise.transpose() * W_;
    by_x.noalias() -= weighted * poseRows(J9_);
    left = noise_(rows, rows);
    left.noalias() -= weighted * noise;
    by_gradient.bottomRows(by_x.rows()) = noise.transpose();
  }
  // [b_g, b_a, g, last velocity, poses]
  MatrixXd G = MatrixXd::Zero(9 + by_x.rows(), kUnknowns);
  G.block<6, 6>(0, kGyroBias).setIdentity();
  G.block<3, 3>(6, kGravity).setIdentity();
  G.bottomRows(by_x.rows()) = by_x;
  MatrixXd in_V = G * P * G.transpose();
  in_V.bottomRightCorner(left.rows(), left.cols()) += left;
  by_gradient += G * P * poseRows(J9_).transpose();
  if (imu_noise_) by_gradient = (by_gradient * whitening_.inverse()).eval();
  if (excess.size() > 0) in_V += by_gradient * excess * by_gradient.transpose();
  const Matrix3d R_WV = rotationBetween(estimate.g_V, -Vector3d::UnitZ());
  return covarianceInWorld(in_V, R_WV, R_WV * estimate.v_VB.back(), gravity_mps2_);
}

}  // namespace etalon
