// The front end with fisheye cameras.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/frontend/stereo_tracker.h"
#include "motion_check.h"
#include "stereo_matcher.h"
#include "textured_wall.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/** 320 x 320 px, 46 degrees to the sides and 65 to the corners: what a flat wall can fill. */
StereoInertialCalibration fisheyeRig() {
  StereoInertialCalibration rig = smallRig();
  for (CameraCalibration& camera : rig.cameras)
    camera.model = CameraModel("pinhole", "equidistant", 320, 320, {200.0, 199.5, 158.2, 161.0},
                               {0.004, 0.0007, -0.002, 0.0002});
  rig.cameras[1].model = rig.cameras[1].model.with("cu", 161.3);
  return rig;
}

TEST(Fisheye, RightPixelsAreFoundToATenthOfAPixel) {
  const StereoInertialCalibration rig = fisheyeRig();
  for (const double depth_m : {0.55, 3.0}) {
    const TexturedWall wall(rig, depth_m);
    StereoTracker tracker(rig, StereoTrackerOptions{});
    const auto [left, right] = wall.pair(SE3());
    const TrackedFrame frame = tracker.track(0, left, right, Eigen::Matrix3d::Identity());
    std::vector<double> errors;
    int in_view = 0;
    for (const Observation& o : frame.observations) {
      const Vector2d truth = wall.pixelOf(wall.pointBehind(o.left, SE3()), 1, SE3());
      in_view += rig.cameras[1].model.inImage(truth, 10.0);
      if (o.has_right) errors.push_back((truth - o.right).norm());
    }
    ASSERT_GT(in_view, 80) << depth_m;
    EXPECT_GT(static_cast<double>(errors.size()), 0.8 * in_view) << depth_m;
    EXPECT_LT(quantile(errors, 0.5), 0.05) << depth_m;
    EXPECT_LT(quantile(errors, 0.9), 0.1) << depth_m;
  }
}

TEST(Fisheye, TracksFollowAMotion) {
  const StereoInertialCalibration rig = fisheyeRig();
  const TexturedWall wall(rig, 3.0);
  StereoTracker tracker(rig, StereoTrackerOptions{});
  const SE3 T_WB(expSO3({0.05, 0.06, 0.1}), {0.03, 0.01, 0.02});
  const auto first = wall.pair(SE3()), second = wall.pair(T_WB);
  const TrackedFrame before =
      tracker.track(0, first.first, first.second, Eigen::Matrix3d::Identity());
  const TrackedFrame after = tracker.track(50'000'000, second.first, second.second, T_WB.R);
  EXPECT_GT(tracker.statistics().tracked, 80);
  std::vector<double> errors;
  for (const Observation& o : after.observations)
    for (const Observation& old : before.observations)
      if (o.id == old.id)
        errors.push_back(
            (wall.pixelOf(wall.pointBehind(old.left, SE3()), 0, T_WB) - o.left).norm());
  EXPECT_LT(quantile(errors, 0.9), 0.1);
}

TEST(Fisheye, ATrackThatLeavesTheLensEnds) {
  // Of 40 px a radian the whole sphere is a disc of 125 px in the middle of the image; what is
  // outside it looks like texture all the same, and moves by 4 px a frame.
  StereoInertialCalibration rig = fisheyeRig();
  for (CameraCalibration& camera : rig.cameras)
    camera.model = CameraModel("pinhole", "equidistant", 320, 320, {40.0, 40.0, 160.0, 160.0},
                               {0.0, 0.0, 0.0, 0.0});
  const CameraModel& camera = rig.cameras[0].model;
  cv::Mat texture(320, 380, CV_8UC1);
  cv::RNG(1).fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {}, 2.0);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  StereoTrackerOptions options;
  options.temporal_epipolar_px = 0.0;  // such a motion of the image is none of a camera
  StereoTracker tracker(rig, options);
  int lost = 0;
  for (int k = 0; k < 15; ++k) {
    const cv::Mat image = texture(cv::Rect(60 - 4 * k, 0, 320, 320)).clone();
    const TrackedFrame frame =
        tracker.track(k * 50'000'000, image, image, Eigen::Matrix3d::Identity());
    EXPECT_GT(frame.observations.size(), 50U);
    for (const Observation& o : frame.observations) EXPECT_TRUE(camera.unproject(o.left)) << k;
    lost += tracker.statistics().lost;
  }
  EXPECT_GT(lost, 5);
}

TEST(Fisheye, TheSearchStepsByPixelsHoweverLongTheBaseline) {
  StereoInertialCalibration rig = fisheyeRig();
  const StereoTrackerOptions options;
  for (const double length_m : {0.1, 1000.0}) {
    rig.cameras[1].T_BC.t = rig.cameras[0].T_BC.t + length_m * Vector3d(1.0, 0.004, -0.01);
    const StereoMatcher matcher(rig, options);
    const auto [least, most] = matcher.visibleInverseDepths(Vector3d::UnitZ());
    EXPECT_EQ(least, 0.0);
    int steps = 0;
    Vector3d ray = rig.rightFromLeft().R * Vector3d::UnitZ(), last = ray;
    double farthest = 0.0;
    for (double rho = 0.0; rho <= most; rho += matcher.searchStep(Vector3d::UnitZ(), rho)) {
      ray = rig.rightFromLeft().R * Vector3d::UnitZ() + rho * rig.rightFromLeft().t;
      farthest = std::max(farthest, angleBetween(ray, last));
      last = ray;
      ++steps;
    }
    EXPECT_LT(steps, 200) << length_m;  // a quarter turn at 2 px of 200 a radian is 157 of them
    EXPECT_LT(farthest, 1.1 * 2.0 / 199.0) << length_m;
  }
}

/** Directions all over the sphere but for a cone behind, as a lens of 220 degrees has them. */
std::vector<TrackedRay> raysOf(const SE3& T_now_before, const CameraModel& camera, bool depths) {
  std::vector<TrackedRay> rays;
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  while (rays.size() < 100) {
    const double theta = 1.9 * std::sqrt(unit(rng)), azimuth = 2.0 * M_PI * unit(rng);
    TrackedRay ray;
    ray.before = {std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth),
                  std::cos(theta)};
    const double inverse_depth = 0.1 + 0.4 * unit(rng);
    const auto pixel = camera.project(T_now_before.R * ray.before + inverse_depth * T_now_before.t);
    if (!pixel) continue;
    ray.inverse_depth = depths ? inverse_depth : -1.0;
    ray.now = camera.measure(*pixel + 0.1 * Vector2d(unit(rng), unit(rng))).value();
    rays.push_back(ray);
  }
  return rays;
}

TEST(Fisheye, MotionIsCheckedBesideAndBehindTheCamera) {
  const CameraModel camera("pinhole", "equidistant", 512, 512, {191.0, 190.9, 254.9, 256.9},
                           {0.0035, 0.0007, -0.0021, 0.0002});
  const SE3 T(expSO3({0.02, -0.03, 0.04}), {0.05, 0.02, -0.08});
  for (const bool depths : {true, false}) {
    std::vector<TrackedRay> rays = raysOf(T, camera, depths);
    // Every tenth goes astray by 2 degrees, which is 7 px.
    for (size_t i = 0; i < rays.size(); i += 10) {
      const Vector3d ray = rays[i].now.ray();
      rays[i].now = camera.directionOf(ray + 0.035 * tangentBasis(ray).col(0)).value();
    }
    const std::vector<char> agree = agreeWithMotion(rays, T.R, camera.focal().x(), 1.0);
    int kept = 0, astray = 0;
    for (size_t i = 0; i < rays.size(); ++i) (i % 10 == 0 ? astray : kept) += agree[i];
    // Without depths one may have gone along its epipolar line, and those beyond 70 degrees are not
    // judged; RANSAC's matrix is that of eight noisy points, in a plane that stretches the noise.
    EXPECT_GE(kept, depths ? 90 : 80);
    EXPECT_LE(astray, depths ? 0 : 10);
  }
}

}  // namespace
}  // namespace etalon
