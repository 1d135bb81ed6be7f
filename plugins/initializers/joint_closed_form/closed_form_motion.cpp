#include "closed_form_motion.h"

#include "etalon/core/so3.h"

namespace etalon::plugins {

namespace {

constexpr int kError = ClosedFormMotion::kError;
using ErrorMatrix = Eigen::Matrix<double, kError, kError>;

/** Propagates the error [rotation, position, velocity] of one node to the next. */
ErrorMatrix transition(const ClosedFormMotion::Node& node, const Preintegration::Deltas& d,
                       double dt) {
  ErrorMatrix F = ErrorMatrix::Identity();
  F.block<3, 3>(0, 0) = d.dR.transpose();
  F.block<3, 3>(3, 0) = -node.R_VB * hat(d.dp);
  F.block<3, 3>(3, 6) = dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(6, 0) = -node.R_VB * hat(d.dv);
  return F;
}

/** Takes the preintegration's errors, which are in the frame of `R_VB`, to V. */
ErrorMatrix toVisualFrame(const Eigen::Matrix3d& R_VB) {
  ErrorMatrix G = ErrorMatrix::Identity();
  G.block<3, 3>(3, 3) = R_VB;
  G.block<3, 3>(6, 6) = R_VB;
  return G;
}

Eigen::Matrix<double, kError, 6> biasJacobian(const Preintegration& p) {
  Eigen::Matrix<double, kError, 6> J = Eigen::Matrix<double, kError, 6>::Zero();
  J.block<3, 3>(0, 0) = p.dR_dbg();
  J.block<3, 3>(3, 0) = p.dp_dbg();
  J.block<3, 3>(3, 3) = p.dp_dba();
  J.block<3, 3>(6, 0) = p.dv_dbg();
  J.block<3, 3>(6, 3) = p.dv_dba();
  return J;
}

}  // namespace

ClosedFormMotion composeMotion(const std::vector<Preintegration>& preintegrations) {
  ClosedFormMotion motion;
  motion.nodes.emplace_back();
  const Eigen::Index n = preintegrations.size();
  motion.covariance = Eigen::MatrixXd::Zero(kError * n, kError * n);
  for (const Preintegration& p : preintegrations) {
    const ClosedFormMotion::Node& last = motion.nodes.back();
    const Preintegration::Deltas& d = p.deltas();
    const ErrorMatrix F = transition(last, d, p.dt()), G = toVisualFrame(last.R_VB);
    ClosedFormMotion::Node next;
    next.t = last.t + p.dt();
    next.R_VB = nearestRotation(last.R_VB * d.dR);
    next.alpha = last.alpha + last.beta * p.dt() + last.R_VB * d.dp;
    next.beta = last.beta + last.R_VB * d.dv;
    next.bias = F * last.bias + G * biasJacobian(p);

    const Eigen::Index row = kError * (motion.nodes.size() - 1);
    ErrorMatrix own = G * p.covariance9() * G.transpose();
    if (row > 0) {
      const Eigen::Index before = row - kError;
      motion.covariance.block(row, 0, kError, row) =
          F * motion.covariance.block(before, 0, kError, row);
      motion.covariance.block(0, row, row, kError) =
          motion.covariance.block(row, 0, kError, row).transpose();
      own += F * motion.covariance.block<kError, kError>(before, before) * F.transpose();
    }
    motion.covariance.block<kError, kError>(row, row) = own;
    motion.nodes.push_back(next);
  }
  return motion;
}

}  // namespace etalon::plugins
