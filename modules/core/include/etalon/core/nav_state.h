#pragma once

#include <Eigen/Core>

#include "etalon/core/se3.h"
#include "etalon/core/time.h"

namespace etalon {

/** Constant biases of an IMU: measured = true + bias + noise. */
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< b_g, rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< b_a, m/s^2
};

/** Offsets of the blocks in the 15-dim error state [rotation, position, velocity, b_g, b_a]. */
namespace state_index {
constexpr int kRotation = 0;
constexpr int kPosition = 3;
constexpr int kVelocity = 6;
constexpr int kGyroBias = 9;
constexpr int kAccelBias = 12;
constexpr int kSize = 15;
}  // namespace state_index

/** The body at one instant, and the biases of its IMU. */
struct NavState {
  SE3 T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s, in W
  ImuBias bias;

  /**
   * This state moved by the error `d`, in the order of state_index: rotation by right perturbation
   * R Exp(d), everything else additive (position and velocity in W).
   */
  NavState plus(const Eigen::Matrix<double, 15, 1>& d) const;
  /** d with other.plus(d) equal to this. */
  Eigen::Matrix<double, 15, 1> minus(const NavState& other) const;

  /** The same state in another world. */
  NavState moved(const SE3& T_WW0) const { return {T_WW0 * T_WB, T_WW0.R * v_WB, bias}; }
};

/** The error of moved() from that of the state, 15 x 15, orthogonal; R_WW0 turns about z. */
Eigen::Matrix<double, 15, 15> errorsTurned(const Eigen::Matrix3d& R_WW0);

/** A state and the instant that it belongs to. */
struct StampedState : NavState {
  TimeNs t = 0;

  StampedState() = default;
  StampedState(TimeNs stamp, const NavState& state) : NavState(state), t(stamp) {}
  StampedState(TimeNs stamp, const SE3& pose,
               const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero(),
               const ImuBias& biases = {})
      : NavState{pose, velocity, biases}, t(stamp) {}
};

}  // namespace etalon
