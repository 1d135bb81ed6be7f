#include "etalon/optimization/bundle/visual_window.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

std::vector<SE3> truePoses(const SyntheticWindow& window) {
  std::vector<SE3> T_WB;
  for (const StampedState& s : window.truth) T_WB.push_back(s.T_WB);
  return T_WB;
}

TEST(Triangulate, IsExactOnExactPixelsAtAnyDistance) {
  for (const double distance_m : {0.0, 20.0, 500.0, 20000.0}) {
    SCOPED_TRACE(distance_m);
    SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.landmarks = 40;
    options.landmark_distance_m = distance_m;
    const SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
    const VisualWindow window =
        buildVisualWindow(synthetic.calibration, synthetic.keyframes(), 0.5);
    const std::vector<SE3> T_WB = truePoses(synthetic);
    int found = 0;
    for (int l = 0; l < window.landmarkCount(); ++l) {
      const size_t id = window.landmark_ids[l];
      const auto p_W = triangulate(window, l, T_WB);
      if (!p_W) continue;
      ++found;
      const double depth = std::max(3.0, distance_m);
      // Pixels are undistorted to 1e-8: an inverse depth from 0.1 m of baseline is as exact.
      EXPECT_LT((*p_W - synthetic.landmarks[id]).norm(), 1e-6 * depth * depth);
    }
    EXPECT_GT(found, 0.9 * window.landmarkCount());
  }
}

TEST(Triangulate, NoiseDoesNotSelectTheNearAmongTheFar) {
  SyntheticWindowOptions options;
  options.landmarks = 100;
  options.landmark_distance_m = 1e9;
  options.sigma_px = 0.5;
  options.keyframes = 2;
  SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
  const VisualWindow window = buildVisualWindow(synthetic.calibration, {&synthetic.frames[0]}, 0.5);
  ASSERT_GT(window.landmarkCount(), 50);
  int at_infinity = 0;
  for (int l = 0; l < window.landmarkCount(); ++l) {
    const auto p_W = triangulate(window, l, truePoses(synthetic));
    ASSERT_TRUE(p_W);  // a stereo pair is enough at any distance
    at_infinity += p_W->norm() > 0.99 * kFarthestLandmark;
  }
  // Half the disparities are negative; four standard deviations of a binomial share.
  EXPECT_NEAR(at_infinity, 0.5 * window.landmarkCount(), 2.0 * std::sqrt(window.landmarkCount()));
}

TEST(Triangulate, WantsCamerasAtTwoPlacesAndNotParallaxOfNoise) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  options.landmarks = 100;
  options.sigma_px = 2.0;
  SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
  for (TrackedFrame& frame : synthetic.frames)
    for (Observation& o : frame.observations) o.has_right = false;
  const VisualWindow window = buildVisualWindow(synthetic.calibration, synthetic.keyframes(), 0.5);
  ASSERT_GT(window.landmarkCount(), 50);
  for (int l = 0; l < window.landmarkCount(); ++l)
    EXPECT_FALSE(triangulate(window, l, truePoses(synthetic)));
}

}  // namespace
}  // namespace etalon
