#include "etalon/pipeline/lost_pose.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/text.h"

namespace etalon {

namespace {
namespace ix = state_index;

/** In the dark without IMU for this long, the velocity is known no better than after a loss, s. */
constexpr double kMostBridgedS = 0.15;

constexpr double kTurnRps = 0.5;  // of a flight
constexpr double kAnyYaw = 1.8;   // rad; standard deviation of a yaw of which nothing is known
}  // namespace

std::string whyLost(const OdometryOutput& output, double max_dead_reckoning_s, bool clock_jumped) {
  if (output.imu_missing && (clock_jumped || output.bridged_s > kMostBridgedS))
    return "neither images nor the IMU tell where the platform is";
  if (output.unlocated_s > max_dead_reckoning_s)
    return format("no image has located the platform for %.1f s", output.unlocated_s);
  return "";
}

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
