#pragma once

// A body that stands still. Private to the module.

#include <deque>
#include <unordered_map>

#include "window.h"

namespace etalon::fixed_lag {

/**
 * Decides from images and IMU together whether the body stands still: over the last half second the
 * rates and accelerations hardly vary, and no track has moved since the rest began (before a rest,
 * over the last half second). Either alone would be deceived: the IMU by a steady motion, the
 * images by a camera that repeats its image. A creeping motion ends the rest when it has moved the
 * tracks by more than their noise.
 */
class RestDetector {
 public:
  /**
   * To be asked once a frame, in time order.
   * @param imu since the frame before, complete; else empty
   * @param sigma_px of a pixel, as the residuals say
   * @param speed that the odometry has predicted, m/s
   * @return whether the body has stood still since the frame before
   */
  bool atRest(const TrackedFrame& frame, const std::vector<ImuSample>& imu, double sigma_px,
              double speed);

 private:
  struct Reference {
    TimeNs t = 0;
    std::unordered_map<LandmarkId, Eigen::Vector2d> pixels;
  };
  bool imuIsCalm() const;

  std::deque<ImuSample> imu_;
  std::deque<Reference> references_;  ///< the oldest is the one to compare with
  bool at_rest_ = false;
};

using RestJacobian = Eigen::Matrix<double, 9, 15>;
/** Whitened rows of a rest that ends in full state `i`: the pose is that of the state before, the
 * velocity is zero. Derivatives both or none, at the linearisation points where those are kept. */
Eigen::Matrix<double, 9, 1> restRows(const Window& window, size_t i, RestJacobian* J_i = nullptr,
                                     RestJacobian* J_j = nullptr);

}  // namespace etalon::fixed_lag
