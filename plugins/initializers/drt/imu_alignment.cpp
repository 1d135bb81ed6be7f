#include "imu_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

ImuAlignment::ImuAlignment(const std::vector<Matrix3d>& R_VB,
                           const std::vector<Preintegration>& preintegrations, double gravity_mps2,
                           const Vector3d& prior_mean, double prior_sigma, bool held)
    : R_VB_(R_VB),
      preintegrations_(preintegrations),
      gravity_mps2_(gravity_mps2),
      prior_mean_(prior_mean),
      prior_sigma_(prior_sigma),
      held_(held || !(prior_sigma > 0.0)) {}

LinearState ImuAlignment::start() const {
  LinearState state;
  state.b_a = prior_mean_;
  Vector3d sum = Vector3d::Zero();
  for (size_t k = 0; k < preintegrations_.size(); ++k)
    sum -= R_VB_[k] * preintegrations_[k].deltas().dv;
  state.g_V = gravity_mps2_ * sum.normalized();
  state.p.assign(R_VB_.size(), Vector3d::Zero());
  state.v = state.p;
  for (size_t k = 0; k < preintegrations_.size(); ++k) {
    const double dt = preintegrations_[k].dt();
    state.p[k + 1] = state.p[k] + state.v[k] * dt + 0.5 * dt * dt * state.g_V +
                     R_VB_[k] * preintegrations_[k].deltas().dp;
    state.v[k + 1] = state.v[k] + state.g_V * dt + R_VB_[k] * preintegrations_[k].deltas().dv;
  }
  return state;
}

ImuAlignment::Rows ImuAlignment::rowsOf(size_t k, const LinearState& state) const {
  const Eigen::Matrix<double, 3, 2> B = gravity_mps2_ * tangentBasis(state.g_V);
  const Preintegration& imu = preintegrations_[k];
  const Preintegration::Deltas d = imu.corrected({imu.bias().gyro, state.b_a});
  const double dt = imu.dt();
  const Matrix3d R_BV = R_VB_[k].transpose();
  Rows rows;
  rows.r.head<3>() =
      R_BV * (state.p[k + 1] - state.p[k] - state.v[k] * dt - 0.5 * dt * dt * state.g_V) - d.dp;
  rows.r.tail<3>() = R_BV * (state.v[k + 1] - state.v[k] - state.g_V * dt) - d.dv;
  rows.J.setZero();
  rows.J.block<3, 3>(0, 0) = -R_BV;
  rows.J.block<3, 3>(0, 3) = R_BV;
  rows.J.block<3, 3>(0, 6) = -R_BV * dt;
  rows.J.block<3, 2>(0, 12) = -0.5 * dt * dt * R_BV * B;
  rows.J.block<3, 3>(0, 14) = -imu.dp_dba();
  rows.J.block<3, 3>(3, 6) = -R_BV;
  rows.J.block<3, 3>(3, 9) = R_BV;
  rows.J.block<3, 2>(3, 12) = -dt * R_BV * B;
  rows.J.block<3, 3>(3, 14) = -imu.dv_dba();
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> noise(
      imu.covariance().block<6, 6>(state_index::kPosition, state_index::kPosition));
  rows.whitening = noise.matrixL().solve(Eigen::Matrix<double, 6, 6>::Identity());
  rows.J = noise.matrixL().solve(rows.J);
  rows.r = noise.matrixL().solve(rows.r);
  return rows;
}

void ImuAlignment::addTo(const LinearState& state, Eigen::MatrixXd* H,
                         Eigen::VectorXd* gradient) const {
  const Eigen::Index n = 3 * R_VB_.size(), kGravity = 2 * n;
  for (size_t k = 0; k < preintegrations_.size(); ++k) {
    const Rows rows = rowsOf(k, state);
    const Eigen::Matrix<double, 17, 17> JtJ = rows.J.transpose() * rows.J;
    const Eigen::Matrix<double, 17, 1> Jtr = rows.J.transpose() * rows.r;
    const Eigen::Index first = 3 * k;
    const Eigen::Index to[3] = {first, n + first, kGravity}, from[3] = {0, 6, 12},
                       size[3] = {6, 6, 5};
    for (int i = 0; i < 3; ++i) {
      gradient->segment(to[i], size[i]) += Jtr.segment(from[i], size[i]);
      for (int j = 0; j < 3; ++j)
        H->block(to[i], to[j], size[i], size[j]) += JtJ.block(from[i], from[j], size[i], size[j]);
    }
  }
  const double information = priorInformation();
  H->diagonal().tail<3>().array() += information;
  gradient->tail<3>() += information * (state.b_a - prior_mean_);
}

double ImuAlignment::priorInformation() const {
  // A held b_a is one with far more information than anything else provides.
  constexpr double kHeld = 1e18;
  return held_ ? kHeld : 1.0 / (prior_sigma_ * prior_sigma_);
}

double ImuAlignment::priorScore() const {
  const double score = priorInformation() * prior_sigma_;
  return score * score;
}

ImuAlignment::NoiseResponse ImuAlignment::noiseResponse(const LinearState& state,
                                                        const Matrix3d& gyro_bias) const {
  const Eigen::Index n = 3 * R_VB_.size();
  const Eigen::Index intervals = n / 3 - 1, sources = 9 * intervals + 3;
  NoiseResponse response;
  response.sources = Eigen::MatrixXd::Zero(sources, sources);
  response.sources.bottomRightCorner<3, 3>() = gyro_bias;
  response.rotations = Eigen::MatrixXd::Zero(n, sources);
  response.gradient = Eigen::MatrixXd::Zero(2 * n + 5, sources);
  for (size_t k = 0; k < preintegrations_.size(); ++k) {
    const Preintegration& imu = preintegrations_[k];
    const Preintegration::Deltas d = imu.corrected({imu.bias().gyro, state.b_a});
    const Eigen::Index first = 3 * k, own = 3 * first;
    response.sources.block<9, 9>(own, own) = imu.covariance9();
    const Eigen::MatrixXd rotation = response.rotations.middleRows<3>(first);
    Eigen::MatrixXd next = d.dR.transpose() * rotation;
    next.middleCols<3>(own) += Matrix3d::Identity();
    next.rightCols<3>() += imu.dR_dbg();
    response.rotations.middleRows<3>(first + 3) = next;

    Eigen::MatrixXd r(6, sources);
    r << hat(d.dp) * rotation, hat(d.dv) * rotation;
    r.middleCols<6>(own + 3) -= Eigen::Matrix<double, 6, 6>::Identity();
    r.topRightCorner<3, 3>() -= imu.dp_dbg();
    r.bottomRightCorner<3, 3>() -= imu.dv_dbg();
    const Rows rows = rowsOf(k, state);
    const Eigen::MatrixXd Jtr = rows.J.transpose() * (rows.whitening * r);
    response.gradient.middleRows<6>(first) += Jtr.topRows<6>();
    response.gradient.middleRows<6>(n + first) += Jtr.middleRows<6>(6);
    response.gradient.bottomRows<5>() += Jtr.bottomRows<5>();
  }
  return response;
}

LinearState ImuAlignment::moved(const LinearState& state, const Eigen::VectorXd& step) const {
  LinearState moved = state;
  const Eigen::Index n = 3 * R_VB_.size();
  for (size_t k = 0; k < R_VB_.size(); ++k) {
    moved.p[k] += step.segment<3>(3 * k);
    moved.v[k] += step.segment<3>(n + 3 * k);
  }
  moved.g_V =
      gravity_mps2_ *
      (state.g_V + gravity_mps2_ * tangentBasis(state.g_V) * step.segment<2>(2 * n)).normalized();
  moved.b_a += step.tail<3>();
  return moved;
}

}  // namespace etalon::plugins
