#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "etalon/core/tracked_frame.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * Tells cameras that repeat their image from a platform that stands still. Two images of a real
 * sensor are never the same bit for bit; those of a simulator without noise are, at rest. So an
 * image that repeats the one before is believed until the motion contradicts it: the tracks of the
 * last frame that was all new moved, or gyro or accelerometer have changed since. From then on it is
 * not, until that camera has a new one. An image without contrast, as of a covered lens, repeats
 * nothing.
 */
class RepeatedImages {
 public:
  /**
   * To be asked once a frame, in time order.
   * @param imu samples between the frame before and this one; may be empty
   * @return whether the left and the right image show the past: then they must not be tracked
   */
  std::array<bool, 2> areRepeated(const cv::Mat& left, const cv::Mat& right,
                                  const std::vector<ImuSample>& imu);

  /** The tracks of a frame of which an image was not called repeated. */
  void tracked(const TrackedFrame& frame);

 private:
  struct Camera {
    cv::Mat previous;                    ///< a copy: the caller may use its buffer again
    std::optional<ImuSample> reference;  ///< mean before its last new image
    bool contradicted = false;
  };
  bool contradicts(const std::optional<ImuSample>& mean, const Camera& camera) const;

  std::array<Camera, 2> cameras_;
  std::map<LandmarkId, Eigen::Vector2d> pixels_;  ///< of the last tracked frame
  double flow_px_ = 0.0;                          ///< median motion of its tracks
  bool all_new_ = true;                           ///< whether the frame asked about last was
};

}  // namespace etalon
