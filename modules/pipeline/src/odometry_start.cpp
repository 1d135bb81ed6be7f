#include "etalon/pipeline/odometry_start.h"

#include <algorithm>

#include "etalon/core/so3.h"
#include "etalon/imu/mean_sample.h"

namespace etalon {
namespace {

using namespace state_index;

// The window's frames are about to determine the state anew, so the prior is wide, except for
// position and yaw, which are free.
constexpr double kSigmaTilt = 0.03;      // rad
constexpr double kSigmaVelocity = 0.1;   // m/s
constexpr double kSigmaGyroBias = 0.02;  // rad/s
constexpr double kSigmaFree = 1e-4;      // m, rad

}  // namespace

OdometryStart odometryStart(const InitializationAttempt& attempt, const SE3& T_WA,
                            const BiasPriors& priors) {
  const SE3 T_AB = attempt.poses().front();
  const Eigen::Vector3d v_A =
      attempt.has_vi_ba ? attempt.vi_ba.states.front().v_WB : attempt.init->states.front().v_WB;
  OdometryStart start;
  start.state.T_WB = T_WA * T_AB;
  start.state.v_WB = T_WA.R * v_A;
  start.state.bias = attempt.bias();
  for (const auto& [id, p_A] : attempt.landmarks) start.landmarks[id] = T_WA * p_A;
  const Eigen::Matrix3d& R_WB = start.state.T_WB.R;
  const Eigen::Vector3d attitude(kSigmaTilt, kSigmaTilt, kSigmaFree);  // about the axes of W
  start.covariance.setZero();
  start.covariance.block<3, 3>(kRotation, kRotation) =
      R_WB.transpose() * attitude.cwiseAbs2().asDiagonal() * R_WB;
  const auto set = [&start](int block, double sigma) {
    start.covariance.diagonal().segment<3>(block).setConstant(sigma * sigma);
  };
  set(kPosition, kSigmaFree);
  set(kVelocity, kSigmaVelocity);
  set(kGyroBias, std::min(kSigmaGyroBias, priors.sigma_gyro_rps));
  set(kAccelBias, priors.sigma_accel_mps2);
  return start;
}

void moveToStamp(double offset_s, const std::vector<ImuSample>& imu, double gravity_mps2,
                 OdometryStart* start) {
  const ImuSample mean = meanSample(imu);
  NavState& state = start->state;
  const double dt = -offset_s;
  const Eigen::Vector3d a_W =
      state.T_WB.R * (mean.accel - state.bias.accel) - gravity_mps2 * Eigen::Vector3d::UnitZ();
  state.T_WB.t += dt * state.v_WB + 0.5 * dt * dt * a_W;
  state.v_WB += dt * a_W;
  state.T_WB.R = state.T_WB.R * expSO3(dt * (mean.gyro - state.bias.gyro));
  start->time_offset_s = offset_s;
}

}  // namespace etalon
