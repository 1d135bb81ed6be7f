#pragma once

#include "etalon/frontend/keyframe_selector.h"
#include "etalon/odometry/odometry.h"
#include "etalon/odometry/stereo_odometry.h"

namespace etalon {

/**
 * Stereo odometry as an Odometry: poses from images alone. The gyro turns the prediction, the
 * accelerometer is not read. Keyframes come at a fixed rate. Of the start it takes the pose, the
 * velocity, the gyro's bias and the landmarks. It gives no covariance.
 */
class StereoVisualOdometry : public Odometry {
 public:
  StereoVisualOdometry(const StereoInertialCalibration& calibration,
                       const StereoOdometryOptions& options,
                       const KeyframeSelectorOptions& keyframes);

  OdometryOutput start(const OdometryStart& start, const TrackedFrame& frame) override;
  /** A frame without observations has the predicted pose; the landmarks wait for the next. */
  OdometryOutput process(const TrackedFrame& frame, const std::vector<ImuSample>& imu) override;
  Trajectory keyframes() const override { return odometry_.keyframes(); }
  std::map<LandmarkId, Eigen::Vector3d> landmarks() const override { return odometry_.landmarks(); }

 private:
  StereoOdometry odometry_;
  double imu_rate_hz_;
  KeyframeSelectorOptions keyframe_options_;
  KeyframeSelector selector_;
  ImuBias bias_;
  /** Of the body since the last frame with observations, as the gyro saw it. */
  Eigen::Matrix3d turned_ = Eigen::Matrix3d::Identity();
  TimeNs last_frame_ = 0, located_at_ = 0;
};

}  // namespace etalon
