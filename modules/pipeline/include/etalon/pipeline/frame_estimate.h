#pragma once

#include <Eigen/Core>
#include <limits>

#include "etalon/odometry/fixed_lag/odometry.h"
#include "etalon/pipeline/pipeline_state.h"

namespace etalon {

/** What was known of a frame when it had been processed: nothing later is in it. */
struct FrameEstimate {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  TimeNs t = 0;
  PipelineState state = PipelineState::kVisual;
  NavState nav;  ///< in W; velocity and biases are zero while stereo odometry runs
  /** Standard deviations of the errors, in the order of state_index; of position and yaw since the
   * last start. NaN while stereo odometry runs. */
  Eigen::Matrix<double, 15, 1> sigma = Eigen::Matrix<double, 15, 1>::Constant(kUnknown);
  /** Of the pose's error, [rotation, position] in the order of state_index, rad and m. */
  Eigen::Matrix<double, 6, 6> pose_covariance = Eigen::Matrix<double, 6, 6>::Constant(kUnknown);
};

/** The state at any instant since the last estimate, carried by the IMU. */
struct ImuRateState {
  TimeNs t = 0;
  /** kDeadReckoning where no frame has come for Pipeline::kNoImageS. */
  PipelineState state = PipelineState::kInertial;
  NavState nav;  ///< in W; biases are those of the last frame
};

}  // namespace etalon
