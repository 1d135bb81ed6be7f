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
 * Tells a camera that repeats its image from a platform that stands still. Two images of a real
 * sensor are never the same bit for bit; those of a simulator without noise are, at rest. So an
 * image that repeats the one before is believed until the motion contradicts it: the tracks of the
 * last frame that was new moved, or gyro or accelerometer have changed since. From then on it is
 * not, until a new image comes. Of a stereo pair one repeated image is enough. An image without
 * contrast, as of a covered lens, repeats nothing.
 */
class RepeatedImages {
 public:
  /**
   * To be asked once a frame, in time order.
   * @param imu samples between the frame before and this one; may be empty
   * @return whether the frame shows the past: then it must not be tracked
   */
  bool isRepeated(const cv::Mat& left, const cv::Mat& right, const std::vector<ImuSample>& imu);

  /** The tracks of a frame that was not called repeated. */
  void tracked(const TrackedFrame& frame);

 private:
  bool contradicts(const std::optional<ImuSample>& mean) const;

  std::array<cv::Mat, 2> previous_;               ///< copies: the caller may use its buffers again
  std::optional<ImuSample> reference_;            ///< mean before the last frame that was new
  std::map<LandmarkId, Eigen::Vector2d> pixels_;  ///< of the last tracked frame
  double flow_px_ = 0.0;                          ///< median motion of its tracks
  bool new_ = true;                               ///< whether the frame asked about last was new
  bool contradicted_ = false;
};

}  // namespace etalon
