#include "etalon/odometry/stereo_visual_odometry.h"

#include "etalon/imu/preintegration.h"
#include "fixed_lag/bridged_imu.h"

namespace etalon {

StereoVisualOdometry::StereoVisualOdometry(const StereoInertialCalibration& calibration,
                                           const StereoOdometryOptions& options,
                                           const KeyframeSelectorOptions& keyframes)
    : odometry_(calibration, options),
      imu_rate_hz_(calibration.imu.rate_hz),
      keyframe_options_(keyframes),
      selector_(keyframes) {}

OdometryOutput StereoVisualOdometry::start(const OdometryStart& start, const TrackedFrame& frame) {
  selector_ = KeyframeSelector(keyframe_options_);
  bias_ = start.state.bias;
  turned_.setIdentity();
  last_frame_ = located_at_ = frame.t;
  odometry_.begin(frame, start.state.T_WB, start.state.v_WB, start.landmarks);
  OdometryOutput out;
  out.t = frame.t;
  out.state = start.state;
  out.inertial = false;
  out.keyframe = selector_.isKeyframe(frame.t);
  out.observations = frame.observations.size();
  return out;
}

OdometryOutput StereoVisualOdometry::process(const TrackedFrame& frame,
                                             const std::vector<ImuSample>& imu) {
  OdometryOutput out;
  out.t = frame.t;
  out.inertial = false;
  out.observations = frame.observations.size();
  out.imu_missing = !isComplete(imu, last_frame_, frame.t, imu_rate_hz_);
  last_frame_ = frame.t;
  if (!imu.empty())  // whatever the noise
    turned_ = turned_ * Preintegration(imu, bias_, ImuNoiseDensities()).deltas().dR;
  if (frame.observations.empty()) {
    out.state.T_WB = odometry_.predict(frame.t, turned_);
  } else {
    out.keyframe = selector_.isKeyframe(frame.t);
    const StereoOdometry::FrameResult found = odometry_.track(frame, turned_, out.keyframe);
    turned_.setIdentity();
    out.state.T_WB = found.T_VB;
    out.used = found.used;
    if (found.located) located_at_ = frame.t;
  }
  out.state.v_WB = odometry_.velocity();
  out.state.bias = bias_;
  out.unlocated_s = secondsBetween(located_at_, frame.t);
  return out;
}

}  // namespace etalon
