#pragma once

#include <optional>
#include <string>

#include "etalon/core/se3.h"
#include "etalon/core/time.h"

namespace etalon {

/** What the poses of a pipeline rest on. */
enum class PipelineState {
  kWaiting,        ///< no image yet
  kVisual,         ///< stereo odometry; its world is aligned with gravity once a start was accepted
  kInertial,       ///< images and IMU together
  kDeadReckoning,  ///< the IMU alone: no image says where the platform is
  kLost,           ///< neither: stereo odometry from a guess, until another start is accepted
};

/** Lower-case name as it stands in files, e.g. "dead_reckoning". */
const char* toString(PipelineState state);

/** By how much a start in flight, or a place that was recognised after it, moved the current pose. */
struct PoseJump {
  SE3 T_before_after;  ///< the pose after, seen from the pose before
  /** Of the pose after as an error in the world of before: [rotation, position], rad and m, in the
   * order of state_index. At a start it is the odometry's when the platform was lost, and what may
   * have happened since where no image located it (LostPose); else that of the sighting. */
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/** The state changed, or the pipeline goes on in it although something is missing. */
struct PipelineEvent {
  TimeNs t = 0;  ///< stamp of the first frame in the new state, or after which it was noticed
  PipelineState state = PipelineState::kWaiting;
  std::string reason;            ///< a clause: "because ..."
  bool remark = false;           ///< the state is as before
  std::optional<PoseJump> jump;  ///< if the pose jumped
};

}  // namespace etalon
