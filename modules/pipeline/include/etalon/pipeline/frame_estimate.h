#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/pipeline/pipeline_state.h"

namespace etalon {

/** What was known of a frame when it had been processed: nothing later is in it. */
struct FrameEstimate {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  TimeNs t = 0;
  PipelineState state = PipelineState::kVisual;
  NavState nav;  ///< in W; velocity and biases are zero while stereo odometry runs
  /** Of the pose's error since the last start, [rotation, position] in the order of state_index, rad
   * and m. While stereo odometry runs NaN, but after a loss LostPose::covariance(). */
  Eigen::Matrix<double, 6, 6> pose_covariance = Eigen::Matrix<double, 6, 6>::Constant(kUnknown);
  /** Of the errors of velocity and biases, in the order of state_index. NaN while stereo odometry
   * runs. */
  Eigen::Matrix<double, 9, 1> motion_variance = Eigen::Matrix<double, 9, 1>::Constant(kUnknown);

  /** Standard deviations of all errors, in the order of state_index. */
  Eigen::Matrix<double, 15, 1> sigma() const {
    Eigen::Matrix<double, 15, 1> variance;
    variance << pose_covariance.diagonal(), motion_variance;
    return variance.unaryExpr([](double v) { return v < 0.0 ? 0.0 : std::sqrt(v); });
  }
};

/** Milliseconds of the stages of one frame. */
struct FrameTiming {
  double frontend_ms = 0.0;
  double odometry_ms = 0.0;
  double initialization_ms = 0.0;
};

/** The poses of the estimates. */
Trajectory trajectoryOf(const std::vector<FrameEstimate>& estimates);

/** Without a new image for this long, the IMU alone carries the pose, s. A camera may be slow. */
inline double noImageS(double image_rate_hz) {
  constexpr double kLeastS = 0.5, kImages = 2.5;
  return image_rate_hz > 0.0 ? std::max(kLeastS, kImages / image_rate_hz) : kLeastS;
}

/** The state at any instant since the last estimate, carried by the IMU. */
struct ImuRateState {
  TimeNs t = 0;
  /** kDeadReckoning where no frame has come for noImageS(). */
  PipelineState state = PipelineState::kInertial;
  NavState nav;  ///< in W; biases are those of the last frame
};

}  // namespace etalon
