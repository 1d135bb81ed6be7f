#include "etalon/imu/preintegration.h"

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
using Eigen::Matrix3d;
using Eigen::Vector3d;

Preintegration::Preintegration(std::vector<ImuSample> samples, const ImuBias& bias,
                               const ImuNoiseDensities& noise)
    : samples_(std::move(samples)), bias_(bias), noise_(noise) {
  integrate();
}

void Preintegration::integrate() {
  using Matrix15d = Eigen::Matrix<double, 15, 15>;
  for (size_t i = 0; i + 1 < samples_.size(); ++i) {
    const double dt = secondsBetween(samples_[i].t, samples_[i + 1].t);
    const Vector3d w = 0.5 * (samples_[i].gyro + samples_[i + 1].gyro) - bias_.gyro;
    const Vector3d a0 = samples_[i].accel - bias_.accel, a1 = samples_[i + 1].accel - bias_.accel;
    const Matrix3d inc = expSO3(w * dt), Jr = rightJacobianSO3(w * dt);
    const Matrix3d R0 = deltas_.dR, R1 = R0 * inc;
    const Vector3d a = 0.5 * (R0 * a0 + R1 * a1);
    const Matrix3d A0 = -0.5 * R0 * hat(a0), A1 = -0.5 * R1 * hat(a1);
    const Matrix3d Rm = 0.5 * (R0 + R1);
    // bias Jacobians
    const Matrix3d J1 = inc.transpose() * dR_dbg_ - Jr * dt;
    const Matrix3d da_dbg = A0 * dR_dbg_ + A1 * J1;
    dp_dbg_ += dv_dbg_ * dt + 0.5 * da_dbg * dt * dt;
    dp_dba_ += dv_dba_ * dt - 0.5 * Rm * dt * dt;
    dv_dbg_ += da_dbg * dt;
    dv_dba_ -= Rm * dt;
    dR_dbg_ = J1;
    Matrix15d F = Matrix15d::Identity();
    F.block<3, 3>(0, 0) = inc.transpose();
    F.block<3, 3>(0, 9) = -Jr * dt;
    const Matrix3d at = A0 + A1 * inc.transpose(), abg = -A1 * Jr * dt;
    F.block<3, 3>(6, 0) = at * dt;
    F.block<3, 3>(6, 9) = abg * dt;
    F.block<3, 3>(6, 12) = -Rm * dt;
    F.block<3, 3>(3, 0) = 0.5 * at * dt * dt;
    F.block<3, 3>(3, 6).diagonal().setConstant(dt);
    F.block<3, 3>(3, 9) = 0.5 * abg * dt * dt;
    F.block<3, 3>(3, 12) = -0.5 * Rm * dt * dt;
    covariance_ = F * covariance_ * F.transpose();
    const double g2 = noise_.gyro_noise_density * noise_.gyro_noise_density * dt;
    const double a2 = noise_.accel_noise_density * noise_.accel_noise_density * dt;
    covariance_.block<3, 3>(0, 0).diagonal().array() += g2;
    covariance_.block<3, 3>(6, 6).diagonal().array() += a2;
    covariance_.block<3, 3>(3, 3).diagonal().array() += 0.25 * a2 * dt * dt;
    covariance_.block<3, 3>(3, 6).diagonal().array() += 0.5 * a2 * dt;
    covariance_.block<3, 3>(6, 3).diagonal().array() += 0.5 * a2 * dt;
    covariance_.block<3, 3>(9, 9).diagonal().array() +=
        noise_.gyro_random_walk * noise_.gyro_random_walk * dt;
    covariance_.block<3, 3>(12, 12).diagonal().array() +=
        noise_.accel_random_walk * noise_.accel_random_walk * dt;
    deltas_.dp += deltas_.dv * dt + 0.5 * a * dt * dt;
    deltas_.dv += a * dt;
    deltas_.dR = R1;
  }
}

Preintegration::Deltas Preintegration::corrected(const ImuBias& b) const {
  const Vector3d dg = b.gyro - bias_.gyro, da = b.accel - bias_.accel;
  return {deltas_.dR * expSO3(dR_dbg_ * dg), deltas_.dv + dv_dbg_ * dg + dv_dba_ * da,
          deltas_.dp + dp_dbg_ * dg + dp_dba_ * da};
}

Preintegration Preintegration::reintegrated(const ImuBias& bias) const {
  return Preintegration(samples_, bias, noise_);
}
}  // namespace etalon
