#include "etalon/pipeline/lost_pose.h"

#include <algorithm>
#include <cmath>

namespace etalon {

namespace {
namespace ix = state_index;

constexpr double kTurnRps = 0.5;  // of a flight
constexpr double kAnyYaw = 1.8;   // rad; standard deviation of a yaw of which nothing is known
}  // namespace

LostPose::LostPose(const NavState& state, const Eigen::Matrix<double, 15, 15>& covariance)
    : at_loss_(covariance.topLeftCorner<6, 6>()),
      speed_mps_(state.v_WB.norm() +
                 std::sqrt(covariance.block<3, 3>(ix::kVelocity, ix::kVelocity).trace())) {}

void LostPose::goBlind(double seconds, bool turned) {
  way_m_ += speed_mps_ * seconds;
  if (!turned) yaw_rad_ = std::min(yaw_rad_ + kTurnRps * seconds, kAnyYaw);
}

Eigen::Matrix<double, 6, 6> LostPose::covariance(const Eigen::Matrix3d& R_WB) const {
  Eigen::Matrix<double, 6, 6> now = at_loss_;
  now.bottomRightCorner<3, 3>().diagonal().array() += way_m_ * way_m_;
  const Eigen::Vector3d vertical_B = R_WB.row(2);
  now.topLeftCorner<3, 3>() += yaw_rad_ * yaw_rad_ * vertical_B * vertical_B.transpose();
  return now;
}

}  // namespace etalon
