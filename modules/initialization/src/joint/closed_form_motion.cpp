#include "etalon/initialization/joint/closed_form_motion.h"

#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {

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

/** Covariance of the nodes' errors by the slow error of every interval. */
Eigen::MatrixXd slowCovariance(const std::vector<Preintegration>& preintegrations,
                               const ClosedFormMotion& motion, const SlowAcceleration& slow) {
  const Eigen::Index n = preintegrations.size();
  Eigen::MatrixXd by_error = Eigen::MatrixXd::Zero(kError * n, 3 * n);  // of the nodes
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const ClosedFormMotion::Node& last = motion.nodes[k];
    const Preintegration& p = preintegrations[k];
    if (k > 0)
      by_error.block(kError * k, 0, kError, 3 * k) =
          transition(last, p.deltas(), p.dt()) * by_error.block(kError * (k - 1), 0, kError, 3 * k);
    by_error.block<kError, 3>(kError * k, 3 * k) =
        toVisualFrame(last.R_VB) * biasJacobian(p).rightCols<3>();
    for (Eigen::Index l = 0; l < n; ++l) {
      const double apart =
          last.t + 0.5 * p.dt() - motion.nodes[l].t - 0.5 * preintegrations[l].dt();
      correlation.block<3, 3>(3 * k, 3 * l).diagonal().setConstant(slow.correlation(apart));
    }
  }
  return slow.sigma_mps2 * slow.sigma_mps2 * by_error * correlation * by_error.transpose();
}

/** A root of the covariance of [position, velocity] along an axis that white noise of the
 * acceleration makes in a time h, sigma^2 [h^3 / 3, h^2 / 2; h^2 / 2, h]: its first integral is
 * Brownian motion. Noise that is alike along all axes is so in every frame. */
Eigen::Matrix2d whiteAccelRoot(double density, double h) {
  Eigen::Matrix2d root;
  root << h / 2.0, h / std::sqrt(12.0), 1.0, 0.0;
  return density * std::sqrt(h) * root;
}

/** The same as a covariance of an interval's error. */
ErrorMatrix whiteAccelCovariance(double density, double h) {
  const Eigen::Matrix2d root = whiteAccelRoot(density, h), covariance = root * root.transpose();
  ErrorMatrix result = ErrorMatrix::Zero();
  for (Eigen::Index i = 0; i < 2; ++i)
    for (Eigen::Index j = 0; j < 2; ++j)
      result.block<3, 3>(3 + 3 * i, 3 + 3 * j).diagonal().setConstant(covariance(i, j));
  return result;
}

/** ClosedFormMotion::white_accel_root. @param densities an interval each */
Eigen::MatrixXd whiteAccelRoot(const std::vector<ClosedFormMotion::Node>& nodes,
                               const Eigen::VectorXd& densities) {
  const Eigen::Index n = densities.size();
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(3 * n, 6 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Matrix2d own = whiteAccelRoot(densities[k], nodes[k + 1].t - nodes[k].t);
    for (Eigen::Index j = k; j < n; ++j) {
      const double later = nodes[j + 1].t - nodes[k + 1].t;
      for (Eigen::Index column = 0; column < 2; ++column)
        root.block<3, 3>(3 * j, 6 * k + 3 * column)
            .diagonal()
            .setConstant(own(0, column) + later * own(1, column));
    }
  }
  return root;
}

}  // namespace

ClosedFormMotion composeMotion(const std::vector<Preintegration>& preintegrations,
                               const SlowAcceleration& slow, const Eigen::VectorXd& white_accel,
                               const std::optional<ImuBias>& bias) {
  ClosedFormMotion motion;
  motion.nodes.emplace_back();
  const Eigen::Index n = preintegrations.size();
  motion.covariance = Eigen::MatrixXd::Zero(kError * n, kError * n);
  Eigen::VectorXd densities(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Preintegration& p = preintegrations[k];
    const ClosedFormMotion::Node& last = motion.nodes.back();
    const Preintegration::Deltas d = bias ? p.corrected(*bias) : p.deltas();
    const ErrorMatrix F = transition(last, d, p.dt()), G = toVisualFrame(last.R_VB);
    ClosedFormMotion::Node next;
    next.t = last.t + p.dt();
    next.R_VB = nearestRotation(last.R_VB * d.dR);
    next.alpha = last.alpha + last.beta * p.dt() + last.R_VB * d.dp;
    next.beta = last.beta + last.R_VB * d.dv;
    next.bias = F * last.bias + G * biasJacobian(p);

    const Eigen::Index row = kError * k;
    ErrorMatrix own = G * p.covariance9() * G.transpose();
    densities[k] = p.noise().accel_noise_density;
    if (white_accel.size() > 0) {
      own += (white_accel[k] * white_accel[k] - 1.0) * whiteAccelCovariance(densities[k], p.dt());
      densities[k] *= white_accel[k];
    }
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
  motion.white_accel_root = whiteAccelRoot(motion.nodes, densities);
  if (slow.sigma_mps2 > 0.0) {
    motion.slow_covariance = slowCovariance(preintegrations, motion, slow);
    motion.covariance += motion.slow_covariance;
  }
  return motion;
}

}  // namespace etalon
