#include "klt.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "textured_wall.h"

namespace etalon {
namespace {

/** Share of a grid of points of the wall's first image that is found where it is in the second. */
double followed(const TexturedWall& wall, const SE3& T_WB, const cv::Mat& first,
                const cv::Mat& second) {
  const StereoTrackerOptions options;
  std::vector<cv::Point2f> from;
  for (int v = 30; v < first.rows - 30; v += 6)
    for (int u = 30; u < first.cols - 30; u += 6)
      from.emplace_back(static_cast<float>(u), static_cast<float>(v));
  std::vector<cv::Point2f> to = from;
  const std::vector<char> good =
      followPoints(buildPyramid(first, options), buildPyramid(second, options), from, &to, options);
  int right = 0;
  for (size_t i = 0; i < good.size(); ++i) {
    const Eigen::Vector3d point = wall.pointBehind({from[i].x, from[i].y}, SE3());
    const Eigen::Vector2d truth = wall.pixelOf(point, 0, T_WB);
    right += good[i] && (truth - Eigen::Vector2d(to[i].x, to[i].y)).norm() < 0.3;
  }
  return static_cast<double>(right) / static_cast<double>(good.size());
}

// Automatic exposure changes the brightness by a fifth from one image to the next (EuRoC's MH_01).
TEST(FollowPoints, FollowsThroughAStepOfExposure) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 3.0);
  const SE3 T_WB(Eigen::Matrix3d::Identity(), {3.0 * 3.0 / 228.6, 0.0, 0.0});
  const cv::Mat first = wall.image(0, SE3()), second = wall.image(0, T_WB);
  const double constant = followed(wall, T_WB, first, second);
  EXPECT_GT(constant, 0.85);
  for (const double factor : {0.3, 0.8, 1.4}) {
    cv::Mat brighter;
    second.convertTo(brighter, CV_8U, factor);
    EXPECT_GT(followed(wall, T_WB, first, brighter), constant - 0.05) << factor;
  }
}

}  // namespace
}  // namespace etalon
