#include "stereo_matcher.h"

#include <gtest/gtest.h>

#include "etalon/frontend/stereo_tracker.h"
#include "textured_wall.h"

namespace etalon {
namespace {

/** The ray of a left pixel in the middle. */
Eigen::Vector3d middleOf(const StereoInertialCalibration& rig) {
  const CameraModel& camera = rig.cameras[0].model;
  return camera.unproject({0.6 * camera.width(), 0.5 * camera.height()}).value();
}

TEST(StereoMatcher, LooksForNoMoreThanTheImageShowsHoweverLongTheBaseline) {
  StereoInertialCalibration rig = smallRig();
  const StereoTrackerOptions options;
  const Eigen::Vector3d baseline = rig.cameras[1].T_BC.t - rig.cameras[0].T_BC.t;
  for (const double length_m : {0.1, 10.0, 1000.0}) {
    rig.cameras[1].T_BC.t = rig.cameras[0].T_BC.t + length_m * baseline.normalized();
    const StereoMatcher matcher(rig, options);
    const auto [least, most] = matcher.visibleInverseDepths(middleOf(rig));
    EXPECT_LE(most, 1.0 / options.min_depth_m);
    // In pixels of disparity: up to the width of the image and the margin on both sides.
    const CameraModel& camera = rig.cameras[1].model;
    EXPECT_LT((most - least) * camera.focal().x() * length_m, 1.2 * camera.width());
  }
}

TEST(StereoMatcher, LooksWhereverTheRightImageShowsThePoint) {
  const StereoInertialCalibration rig = smallRig();
  const StereoTrackerOptions options;  // the matcher refers to them
  const StereoMatcher matcher(rig, options);
  const CameraModel& left = rig.cameras[0].model;
  const CameraModel& right = rig.cameras[1].model;
  int visible = 0;
  for (int u = 0; u < left.width(); u += 10)
    for (int v = 0; v < left.height(); v += 10) {
      const Eigen::Vector3d ray = left.unproject(Eigen::Vector2d(u, v)).value();
      const auto [least, most] = matcher.visibleInverseDepths(ray);
      for (double rho = 0.0; rho < 3.3; rho += 0.1) {
        const SE3 T = rig.rightFromLeft();
        const auto pixel = right.project(T.R * ray + rho * T.t);
        if (!pixel || !right.inImage(*pixel)) continue;
        ++visible;
        EXPECT_TRUE(least <= rho && rho <= most) << u << " " << v << " " << rho;
      }
    }
  EXPECT_GT(visible, 1000);
}

}  // namespace
}  // namespace etalon
