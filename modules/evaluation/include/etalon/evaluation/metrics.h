#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"

namespace etalon {

/** Criterion of success, the strictest in public use (OpenVINS). */
constexpr double kSuccessGravityDeg = 2.0;
constexpr double kSuccessVelocityMps = 0.1;

/** The scale of a window is evaluated where its path is longer than this, m. */
constexpr double kMinPathForScale = 0.05;

/**
 * Errors of one initialized window against ground truth. A metric that the ground truth does not
 * allow is NaN. W is the estimate's gravity-aligned world, G the ground truth's.
 */
struct WindowErrors {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  int keyframes = 0;            ///< keyframes with ground truth: those that were compared
  double rre_deg = kNone;       ///< RMSE over consecutive pairs of the relative-rotation error, deg
  double ate_m = kNone;         ///< RMSE of positions after SE(3) alignment, no scale, m
  double gravity_deg = kNone;   ///< gravity direction in the body of the first keyframe, deg
  double velocity_mps = kNone;  ///< RMSE of the velocity vector's error, in the body frame, m/s
  double gyro_bias_rps = kNone;    ///< norm of the bias vector's error, rad/s
  double accel_bias_mps2 = kNone;  ///< norm of the bias vector's error, m/s^2
  double scale_error = kNone;      ///< abs(1 - s) of the Sim(3) alignment
  double ate_yaw_m = kNone;        ///< as ate_m, but aligned in yaw and position only, m
  /** As gravity_deg, but against gravity as the whole recording's IMU says it is, deg. */
  double gravity_corrected_deg = kNone;
  /** Squared error over the covariance that the estimate claims, a degree of freedom (setNees()): 1
   * on average where the claim is right. NaN where none is made. */
  double tilt_nees = kNone;        ///< of the first keyframe, 2 degrees of freedom
  double velocity_nees = kNone;    ///< of the last keyframe, 3
  double gyro_bias_nees = kNone;   ///< 3
  double accel_bias_nees = kNone;  ///< 3

  /** Gravity < 2 deg and velocity < 0.1 m/s; nothing where one of them is not known. */
  std::optional<bool> success() const;
  /** Which of "tilt", "velocity" and "accelerometer bias" is farther off than 3.5 standard deviations
   * of the claimed covariance: less likely than 4.65e-4, a block at a time. A ground truth's gyro
   * bias is not known well enough to count. */
  std::vector<std::string> outsideClaim() const;
};

/**
 * Compares the keyframes of an initialization with ground truth. Keyframes without ground truth are
 * left out; pairs are consecutive keyframes that both have it. Both worlds are taken to have
 * gravity along -z; a tilt of the ground truth's world counts as error, except in
 * gravity_corrected_deg. True biases are the ground truth's mean over the keyframes.
 * @param gravity_direction_G unit vector of gravity in the ground truth's world
 * (GroundTruthCheck::gravity_direction_G), for gravity_corrected_deg; NaN without
 */
WindowErrors evaluateWindow(
    const std::vector<StampedState>& states, const ImuBias& bias, const GroundTruth& ground_truth,
    const std::optional<Eigen::Vector3d>& gravity_direction_G = std::nullopt);

/** Statistics of a set of non-negative errors. NaN where the set is empty. */
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = WindowErrors::kNone, mean = WindowErrors::kNone, median = WindowErrors::kNone;
  double max = WindowErrors::kNone;
  double min = WindowErrors::kNone;
  double std = WindowErrors::kNone;  ///< of the set itself: divided by count
  double sse = WindowErrors::kNone;  ///< sum of squares
};

ErrorStatistics statisticsOf(std::vector<double> errors);

/** Length of the polygon through the points. */
double pathLength(const std::vector<Eigen::Vector3d>& points);

/** Errors of a trajectory: position, m, and rotation angle, deg. */
struct TrajectoryErrors {
  ErrorStatistics position_m, rotation_deg;
};

}  // namespace etalon
