#pragma once

#include <opencv2/core.hpp>
#include <utility>

#include "etalon/core/calibration.h"

namespace etalon {

/**
 * A flat wall with a smooth random texture, z = depth_m in W, seen by a stereo rig: images whose
 * every pixel is known to belong to a point of the wall, through the cameras' distortion.
 */
class TexturedWall {
 public:
  /** @param contrast 0 to 1: of the texture around middle gray */
  TexturedWall(const StereoInertialCalibration& calibration, double depth_m, double contrast = 1.0,
               int seed = 1);

  /** What a camera sees, CV_8UC1; black where it sees no wall. */
  cv::Mat image(size_t camera, const SE3& T_WB) const;
  std::pair<cv::Mat, cv::Mat> pair(const SE3& T_WB) const {
    return {image(0, T_WB), image(1, T_WB)};
  }

  /** The point of the wall (in W, m) behind a left pixel. */
  Eigen::Vector3d pointBehind(const Eigen::Vector2d& left_pixel, const SE3& T_WB) const;
  /** Its pixel in a camera; the point must be in view. */
  Eigen::Vector2d pixelOf(const Eigen::Vector3d& p_W, size_t camera, const SE3& T_WB) const;

 private:
  StereoInertialCalibration calibration_;
  double depth_m_;
  cv::Mat texture_;
  double texel_m_;
  std::array<cv::Mat, 2> rays_;  ///< CV_64FC2, undistorted normalised coordinates of each pixel
};

/** EuRoC's lenses and baseline at half its resolution, 376 x 240; B is the left camera. */
StereoInertialCalibration smallRig();

}  // namespace etalon
