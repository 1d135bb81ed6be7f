#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/core/tracked_frame.h"

namespace etalon {

/** Section [frontend] of the configuration. */
struct StereoTrackerOptions {
  int max_features = 250;             ///< landmarks followed at a time
  int flight_features = 200;          ///< the same in flight, where the odometry knows its motion
  int klt_window_px = 9;              ///< side of the KLT patch
  int klt_levels = 4;                 ///< pyramid levels above the full image
  int klt_iterations = 30;            ///< per level, at most
  double klt_epsilon_px = 0.05;       ///< a KLT iteration that moves less ends the level
  double epipolar_px = 1.5;           ///< distance of a right pixel from its epipolar line
  double temporal_epipolar_px = 1.0;  ///< distance from where the motion takes it; 0: no check
  double min_distance_px = 10.0;      ///< between landmarks
  double min_corner_response = 1e-4;  ///< least eigenvalue of the structure tensor (OpenCV's scale)
  double min_depth_m = 0.3;           ///< nearest landmark that is looked for in the right image
  double min_correlation = 0.7;       ///< of a patch in the right image
  int anchor_window_px = 17;          ///< side of the patch kept from a track's first frame
  int anchor_iterations = 8;          ///< of its alignment, at most
  double anchor_epsilon_px = 0.02;    ///< an iteration that moves less ends it
  double anchor_reach_px = 1.5;       ///< correction of a track by its anchor, at most
  double anchor_min_correlation = 0.8;  ///< of an aligned anchor in the left image
  int anchor_patience = 2;              ///< frames in a row without alignment before a track ends
  double stereo_reach_px = 4.0;         ///< of a right pixel from its guess
  int border_px = 6;                    ///< no landmark nearer to the edge of the image

  void declare(ParameterSet& parameters);
};

/** What the tracker did with a frame. */
struct TrackingStatistics {
  int tracked = 0;      ///< landmarks followed from the previous frame
  int lost = 0;         ///< given up in this frame (all reasons)
  int added = 0;        ///< new landmarks
  int with_stereo = 0;  ///< observations that have a right pixel
  double milliseconds = 0.0;
};

/**
 * Follows corners through the raw images of a stereo camera. From frame to frame pyramidal KLT
 * starts at a guess by the gyro's rotation. Then every track
 * is aligned with the patch that it started from (affine, any gain), so that errors do not add up.
 * A track ends where that patch no longer fits, or where it does not move as the camera does. The
 * right image is searched with the same patch and checked against the epipolar geometry. The same
 * images give the same tracks, bit for bit.
 */
class StereoTracker {
 public:
  /** @throws ConfigError if the side of a patch is even: a patch has a pixel in its middle */
  StereoTracker(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options);
  ~StereoTracker();

  /**
   * @param left, right CV_8UC1 of the calibrated size (DataError otherwise)
   * @param R_prev_cur rotation of the body from the previous frame to this one as the gyro saw it
   *        (R_B(prev)B(cur)); identity if unknown
   * @param in_flight whether StereoTrackerOptions::flight_features are enough
   */
  TrackedFrame track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                     const Eigen::Matrix3d& R_prev_cur, bool in_flight = false);

  const TrackingStatistics& statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon
