#include "etalon/pipeline/odometry_start.h"

#include "etalon/core/degrees.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

using Matrix15d = Eigen::Matrix<double, 15, 15>;
using namespace state_index;

constexpr double kRoughTilt = 2.0 / kDegreesPerRadian;  // rad
constexpr double kRoughVelocity = 0.1;                  // m/s
constexpr double kRoughGyroBias = 0.01;                 // rad/s
constexpr double kRoughAccelBias = 0.1;                 // m/s^2
/** Of position and yaw, which are free: m and rad. */
constexpr double kFree = 1e-4;

Matrix15d roughCovariance() {
  Eigen::Matrix<double, 15, 1> sigma;
  sigma.segment<3>(kRotation).setConstant(kRoughTilt);
  sigma.segment<3>(kPosition).setConstant(kFree);
  sigma.segment<3>(kVelocity).setConstant(kRoughVelocity);
  sigma.segment<3>(kGyroBias).setConstant(kRoughGyroBias);
  sigma.segment<3>(kAccelBias).setConstant(kRoughAccelBias);
  return sigma.cwiseAbs2().asDiagonal();
}

/** From Initialization::covariance: [b_g, b_a, tilt of the world, velocity]. */
Matrix15d covarianceOf(const Initialization& result, const Eigen::Matrix3d& R_AB) {
  Eigen::Matrix<double, 15, 11> J = Eigen::Matrix<double, 15, 11>::Zero();
  J.block<3, 2>(kRotation, 6) = R_AB.transpose().leftCols<2>();
  J.block<3, 3>(kVelocity, 8).setIdentity();
  J.block<3, 3>(kGyroBias, 0).setIdentity();
  J.block<3, 3>(kAccelBias, 3).setIdentity();
  return J * result.covariance * J.transpose();
}

}  // namespace

NavState stateOf(const InitializationAttempt& attempt, size_t k, const SE3& T_WA) {
  const Eigen::Vector3d& v_A =
      attempt.has_vi_ba ? attempt.vi_ba.states[k].v_WB : attempt.init->states[k].v_WB;
  NavState state;
  state.T_WB = T_WA * attempt.poses()[k];
  state.v_WB = T_WA.R * v_A;
  state.bias = attempt.bias();
  return state;
}

OdometryStart odometryStart(const InitializationAttempt& attempt, const SE3& T_WA) {
  OdometryStart start;
  const std::vector<SE3> poses = attempt.poses();
  const SE3& T_AB = poses.back();
  Matrix15d covariance;
  if (attempt.has_vi_ba) {
    const Eigen::MatrixXd& joint = attempt.vi_ba.covariance;
    covariance =
        joint.rows() >= 15 ? Matrix15d(joint.bottomRightCorner<15, 15>()) : roughCovariance();
  } else {
    covariance = attempt.init->covariance.rows() == 11 ? covarianceOf(*attempt.init, T_AB.R)
                                                       : roughCovariance();
  }
  start.state = stateOf(attempt, poses.size() - 1, T_WA);
  Matrix15d turn = Matrix15d::Identity();
  turn.block<3, 3>(kPosition, kPosition) = T_WA.R;
  turn.block<3, 3>(kVelocity, kVelocity) = T_WA.R;
  start.covariance = turn * covariance * turn.transpose();
  // The window's first keyframe is its gauge; the odometry's own gauge is where it begins.
  start.covariance.diagonal().segment<6>(kRotation).array() += kFree * kFree;
  return start;
}

}  // namespace etalon
