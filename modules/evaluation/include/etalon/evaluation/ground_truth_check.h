#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * What a recording's ground truth is worth, told by the recording's own IMU. NaN where it cannot be
 * found. It describes the recording; a method that fits a bias to every window may come below
 * `rre_deg` (checkWindowTruth() has the bound for those).
 */
struct GroundTruthCheck {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double interval_s = kNone;  ///< length of the intervals behind rre_deg
  /** RMSE over all intervals of the angle between the ground truth's relative rotation and the
   * gyro's, integrated with the one constant bias that fits them best, deg. */
  double rre_deg = kNone;
  ImuBias bias;  ///< constant biases that fit the whole recording best, rad/s and m/s^2
  /** Unit vector of gravity in the ground truth's world as the whole recording's accelerometer says
   * it is; (0, 0, -1) where it cannot be found. */
  Eigen::Vector3d gravity_direction_G = -Eigen::Vector3d::UnitZ();
  double world_tilt_deg = kNone;  ///< angle between gravity_direction_G and (0, 0, -1), deg

  /** gravity_direction_G where it could be found, for evaluateWindow(). */
  std::optional<Eigen::Vector3d> foundGravityDirection() const {
    if (std::isnan(world_tilt_deg)) return std::nullopt;
    return gravity_direction_G;
  }
};

/**
 * Compares a whole recording's ground truth with its IMU. Rotations: gyro integration over
 * consecutive intervals against the ground truth, one constant bias. Gravity: least squares of
 * velocity changes (from the ground truth's positions where it has no velocity) over the intervals,
 * unknown gravity vector and constant accelerometer bias.
 * @param imu increasing in time
 * @param interval_s length of an interval; a quarter of a second is a pair of keyframes at 4 Hz
 */
GroundTruthCheck checkGroundTruth(const GroundTruth& ground_truth,
                                  const std::vector<ImuSample>& imu, double interval_s = 0.25);

/** What a window's ground truth is worth, told by the IMU. NaN where it cannot be found. */
struct WindowTruthCheck {
  /** The least RRE that integrating the gyro with one constant bias can have: RMSE over consecutive
   * keyframes of the angle between the ground truth's relative rotation and the gyro's, with the
   * bias that fits this window's ground truth best, deg. */
  double rre_deg = GroundTruthCheck::kNone;
  /** Norm of that bias less the one that the ground truth states (mean over the keyframes), rad/s:
   * the error of who has the ground truth's own rotations. */
  double gyro_bias_rps = GroundTruthCheck::kNone;
  /** Largest change of velocity between consecutive keyframes that the ground truth has and the
   * accelerometer has not, m/s: length of v_1 - v_0 - g dt - R_0 (dv + dv_dba b_a), with the b_a that
   * fits this window's ground truth best. Of three pairs or more, and of a ground truth that has
   * velocities. */
  double velocity_step_mps = GroundTruthCheck::kNone;
};

/**
 * @param keyframes stamps, increasing; pairs that ground truth and IMU do not cover are left out
 * @param gravity_G m/s^2
 */
WindowTruthCheck checkWindowTruth(const GroundTruth& ground_truth, const ImuBuffer& imu,
                                  const std::vector<TimeNs>& keyframes,
                                  const Eigen::Vector3d& gravity_G = {0.0, 0.0, -9.81});

}  // namespace etalon
