#include "imu_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "etalon/optimization/gravity_sphere.h"

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

ImuAlignment::ImuAlignment(const std::vector<Matrix3d>& R_VB,
                           const std::vector<Preintegration>& preintegrations, double gravity_mps2,
                           const Vector3d& prior_mean, double prior_sigma)
    : R_VB_(R_VB),
      preintegrations_(preintegrations),
      gravity_mps2_(gravity_mps2),
      prior_mean_(prior_mean),
      prior_sigma_(prior_sigma) {}

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

void ImuAlignment::addTo(const LinearState& state, Eigen::MatrixXd* H,
                         Eigen::VectorXd* gradient) const {
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(R_VB_.size()), kGravity = 2 * n;
  const Eigen::Matrix<double, 3, 2> B = gravity_mps2_ * tangentBasis(state.g_V);
  for (size_t k = 0; k < preintegrations_.size(); ++k) {
    const Preintegration& imu = preintegrations_[k];
    const Preintegration::Deltas d = imu.corrected({imu.bias().gyro, state.b_a});
    const double dt = imu.dt();
    const Matrix3d R_BV = R_VB_[k].transpose();
    Eigen::Matrix<double, 6, 1> r;
    r.head<3>() =
        R_BV * (state.p[k + 1] - state.p[k] - state.v[k] * dt - 0.5 * dt * dt * state.g_V) - d.dp;
    r.tail<3>() = R_BV * (state.v[k + 1] - state.v[k] - state.g_V * dt) - d.dv;
    // Columns: p_k, p_k+1, v_k, v_k+1, gravity, b_a.
    Eigen::Matrix<double, 6, 17> J = Eigen::Matrix<double, 6, 17>::Zero();
    J.block<3, 3>(0, 0) = -R_BV;
    J.block<3, 3>(0, 3) = R_BV;
    J.block<3, 3>(0, 6) = -R_BV * dt;
    J.block<3, 2>(0, 12) = -0.5 * dt * dt * R_BV * B;
    J.block<3, 3>(0, 14) = -imu.dp_dba();
    J.block<3, 3>(3, 6) = -R_BV;
    J.block<3, 3>(3, 9) = R_BV;
    J.block<3, 2>(3, 12) = -dt * R_BV * B;
    J.block<3, 3>(3, 14) = -imu.dv_dba();
    const Eigen::LLT<Eigen::Matrix<double, 6, 6>> noise(
        imu.covariance().block<6, 6>(state_index::kPosition, state_index::kPosition));
    J = noise.matrixL().solve(J);
    r = noise.matrixL().solve(r);
    const Eigen::Matrix<double, 17, 17> JtJ = J.transpose() * J;
    const Eigen::Matrix<double, 17, 1> Jtr = J.transpose() * r;
    const Eigen::Index first = 3 * static_cast<Eigen::Index>(k);
    const Eigen::Index to[3] = {first, n + first, kGravity}, from[3] = {0, 6, 12},
                       size[3] = {6, 6, 5};
    for (int i = 0; i < 3; ++i) {
      gradient->segment(to[i], size[i]) += Jtr.segment(from[i], size[i]);
      for (int j = 0; j < 3; ++j)
        H->block(to[i], to[j], size[i], size[j]) += JtJ.block(from[i], from[j], size[i], size[j]);
    }
  }
  // No freedom is an information that nothing else comes near to.
  constexpr double kFixed = 1e18;
  const double information = prior_sigma_ > 0.0 ? 1.0 / (prior_sigma_ * prior_sigma_) : kFixed;
  H->diagonal().tail<3>().array() += information;
  gradient->tail<3>() += information * (state.b_a - prior_mean_);
}

LinearState ImuAlignment::moved(const LinearState& state, const Eigen::VectorXd& step) const {
  LinearState moved = state;
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(R_VB_.size());
  for (size_t k = 0; k < R_VB_.size(); ++k) {
    moved.p[k] += step.segment<3>(3 * static_cast<Eigen::Index>(k));
    moved.v[k] += step.segment<3>(n + 3 * static_cast<Eigen::Index>(k));
  }
  moved.g_V =
      gravity_mps2_ *
      (state.g_V + gravity_mps2_ * tangentBasis(state.g_V) * step.segment<2>(2 * n)).normalized();
  moved.b_a += step.tail<3>();
  return moved;
}

}  // namespace etalon::plugins
