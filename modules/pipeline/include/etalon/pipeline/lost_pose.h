#pragma once

#include <string>

#include "etalon/core/nav_state.h"
#include "etalon/odometry/odometry.h"

namespace etalon {

/**
 * Why an odometry that reads the IMU is lost after a frame that images did not locate: a clause;
 * empty while dead reckoning carries the pose.
 * @param clock_jumped since the frame before: no time is known that dead reckoning could bridge
 */
std::string whyLost(const OdometryOutput& output, double max_dead_reckoning_s, bool clock_jumped);

/**
 * How far off the pose may be while stereo odometry runs from a guess: as at the loss, and for the
 * time in which nothing was seen as far as the platform may have gone. It may fly on as fast as it
 * did then and one sigma more, to any side. Where not even the gyro says how it turned meanwhile, by
 * 0.5 rad/s about the vertical.
 */
class LostPose {
 public:
  LostPose() = default;
  /** @param state at the loss @param covariance of its error, in the order of state_index */
  LostPose(const NavState& state, const Eigen::Matrix<double, 15, 15>& covariance);

  /** For this long no image located the platform. @param turned the gyro said how it turned */
  void goBlind(double seconds, bool turned);

  /** [rotation, position] of a pose with this attitude, rad and m, in the order of state_index. */
  Eigen::Matrix<double, 6, 6> covariance(const Eigen::Matrix3d& R_WB) const;

 private:
  Eigen::Matrix<double, 6, 6> at_loss_ = Eigen::Matrix<double, 6, 6>::Zero();
  double speed_mps_ = 0.0;  ///< at the loss, and one sigma more
  double way_m_ = 0.0;      ///< that it may have gone since
  double yaw_rad_ = 0.0;    ///< by which it may have turned since
};

}  // namespace etalon
