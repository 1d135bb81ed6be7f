#pragma once

#include <array>
#include <optional>

#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/repeated_images.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_buffer.h"

namespace etalon {

/** What the front end makes of a frame. */
struct FrontFrame {
  TimeNs t = 0;
  std::optional<TrackedFrame> tracked;  ///< nothing: both images show the past
  /** Pixels shared with whoever delivered them; black where a camera repeats its image. */
  StereoFrame images;
  std::array<bool, 2> repeated{};  ///< cameras whose image shows the past
  double ms = 0.0;
};

/** Images to tracks, with the gyro's help. Knows nothing of the estimator but the gyro's bias and
 * whether it flies. */
class FrontStage {
 public:
  FrontStage(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options);

  /**
   * The next frame.
   * @param imu the samples since trackedAt(), as far as there are any
   * @param in_flight whether the odometry has started (StereoTrackerOptions::flight_features)
   */
  FrontFrame process(const StereoFrame& frame, const ImuBuffer& imu, const ImuBias& bias,
                     bool in_flight = false);

  /** Stamp of the last frame that the tracker saw. */
  const std::optional<TimeNs>& trackedAt() const { return tracked_at_; }

 private:
  RepeatedImages repeated_images_;
  StereoTracker tracker_;
  std::optional<TimeNs> tracked_at_;
  std::optional<TimeNs> last_frame_;  ///< the last frame of all
};

}  // namespace etalon
