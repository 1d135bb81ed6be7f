#pragma once

#include <optional>

#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/pipeline/repeated_images.h"

namespace etalon {

/** What the front end makes of a frame. */
struct FrontFrame {
  TimeNs t = 0;
  std::optional<TrackedFrame> tracked;  ///< nothing: the frame shows the past
  /** Of the body since the last tracked frame, as the gyro saw it; identity where it saw nothing. */
  Eigen::Matrix3d R_prev_cur = Eigen::Matrix3d::Identity();
  StereoFrame images;      ///< pixels shared with whoever delivered them
  bool after_gap = false;  ///< the last tracked frame is more than max_gap_s older
  double ms = 0.0;
};

/** Images to tracks, with the gyro's help. Knows nothing of the estimator but the gyro's bias. */
class FrontStage {
 public:
  /** @param max_gap_s see InputOptions @param keep_imu_s of samples, where no frame comes */
  FrontStage(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options,
             const ImuNoiseDensities& noise, double max_gap_s, double keep_imu_s);

  void add(const ImuSample& sample);
  /** Nothing is integrated across a jump of the clock. */
  void forgetImu() { imu_ = ImuBuffer(); }

  FrontFrame process(const StereoFrame& frame, const ImuBias& bias);

 private:
  ImuNoiseDensities noise_;
  double max_gap_s_, keep_imu_s_;
  RepeatedImages repeated_images_;
  StereoTracker tracker_;
  ImuBuffer imu_;
  std::optional<TimeNs> tracked_at_;  ///< the last frame that the tracker saw
  std::optional<TimeNs> last_frame_;  ///< the last frame of all
};

}  // namespace etalon
