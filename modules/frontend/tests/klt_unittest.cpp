#include "klt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "textured_wall.h"

namespace etalon {
namespace {

/** A wall that moves by 3 px, and in the second image another wall in front of its middle. */
struct Occlusion {
  Occlusion() {
    const StereoInertialCalibration rig = smallRig();
    const TexturedWall wall(rig, 3.0), other(rig, 3.0, 1.0, 2);
    const SE3 T_WB(Eigen::Matrix3d::Identity(), {3.0 * 3.0 / 228.6, 0.0, 0.0});
    first = wall.image(0, SE3());
    second = wall.image(0, T_WB);
    other.image(0, SE3())(kCovered).copyTo(second(kCovered));
  }
  /** Share of a grid of points, all seen in both images, or all covered in the second, that is
   * followed. */
  double followed(bool covered, const StereoTrackerOptions& options) const {
    const cv::Rect inside(kCovered.x + 15, kCovered.y + 15, kCovered.width - 30,
                          kCovered.height - 30);
    const cv::Rect outside(kCovered.x - 15, kCovered.y - 15, kCovered.width + 30,
                           kCovered.height + 30);
    std::vector<cv::Point2f> from;
    for (int v = 30; v < first.rows - 30; v += 6)
      for (int u = 30; u < first.cols - 30; u += 6)
        if (covered ? inside.contains({u, v}) : !outside.contains({u, v}))
          from.emplace_back(static_cast<float>(u), static_cast<float>(v));
    std::vector<cv::Point2f> to = from;
    const std::vector<char> good = followPoints(buildPyramid(first, options),
                                                buildPyramid(second, options), from, &to, options);
    EXPECT_GT(good.size(), 100U);
    return static_cast<double>(std::count(good.begin(), good.end(), 1)) /
           static_cast<double>(good.size());
  }
  const cv::Rect kCovered{120, 60, 130, 110};
  cv::Mat first, second;
};

// Automatic exposure changes the brightness by a fifth from one image to the next (EuRoC's MH_01).
TEST(FollowPoints, FollowsThroughAStepOfExposure) {
  const StereoTrackerOptions options;
  Occlusion occlusion;
  const double constant = occlusion.followed(false, options);
  const cv::Mat second = occlusion.second;
  for (const double factor : {0.3, 0.8, 1.4}) {
    second.convertTo(occlusion.second, CV_8U, factor);
    EXPECT_GT(occlusion.followed(false, options), constant - 0.05) << factor;
  }
}

TEST(FollowPoints, DropsWhatDoesNotFindItsWayBack) {
  const Occlusion occlusion;
  StereoTrackerOptions options;
  const double seen = occlusion.followed(false, options),
               covered = occlusion.followed(true, options);
  options.forward_backward_px = 1e9;
  const double seen_unchecked = occlusion.followed(false, options),
               covered_unchecked = occlusion.followed(true, options);
  EXPECT_GT(seen, 0.85);
  // KLT finds something in front of the wall, too; a tenth of it finds back by chance.
  EXPECT_LT(covered, 0.2);
  EXPECT_GT(seen_unchecked, 0.95);
  EXPECT_GT(covered_unchecked, 0.9);
}

}  // namespace
}  // namespace etalon
