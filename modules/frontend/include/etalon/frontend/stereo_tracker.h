#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/frontend/tracked_frame.h"

namespace etalon {

/** Section [frontend] of the configuration. */
struct StereoTrackerOptions {
  int max_features = 300;  ///< landmarks followed at a time
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
 * Follows corners through the raw images of a stereo camera: pyramidal KLT in time and from left to right.
 * Deterministic: same images, same tracks.
 */
class StereoTracker {
 public:
  StereoTracker(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options);
  ~StereoTracker();

  /**
   * @param left, right CV_8UC1 of the calibrated size (DataError otherwise)
   * @param R_prev_cur rotation of the body from the previous frame to this one as the gyro saw it
   *        (R_B(prev)B(cur)); identity if unknown
   */
  TrackedFrame track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                     const Eigen::Matrix3d& R_prev_cur);

  const TrackingStatistics& statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon
