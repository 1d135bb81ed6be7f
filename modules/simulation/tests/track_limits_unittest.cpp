// What simulated tracks leave out, and which of too many they keep; where landmarks are scattered.

#include <gtest/gtest.h>

#include <set>

#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/track_synthesis.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

/** A body that stands still at the origin of W, and points where its left camera sees them. */
class TrackLimits : public ::testing::Test {
 protected:
  TrackLimits() : rig_(eurocCalibration()) { options_.sigma_px = 0.0; }
  /** The point that the left camera shows at the pixel, `depth` m away. */
  Vector3d at(const Eigen::Vector2d& pixel, double depth) const {
    return rig_.cameras[0].T_BC * (depth * *rig_.cameras[0].model.unproject(pixel));
  }
  std::vector<TrackedFrame> tracks(const std::vector<Vector3d>& points, size_t frames = 1) const {
    return simulateTracks(Trajectory(frames), rig_, points, options_);
  }
  static std::vector<LandmarkId> ids(const TrackedFrame& frame) {
    std::vector<LandmarkId> ids;
    for (const Observation& o : frame.observations) ids.push_back(o.id);
    return ids;
  }

  StereoInertialCalibration rig_;
  TrackSynthesisOptions options_;
};

TEST_F(TrackLimits, DepthAndBorderAreThoseOfTheOptions) {
  options_.min_depth_m = 1.0;
  options_.max_depth_m = 10.0;
  options_.border_px = 20.0;
  const auto frames = tracks({at({300, 200}, 0.99), at({300, 200}, 1.01), at({300, 200}, 9.99),
                              at({300, 200}, 10.01), at({19.9, 200}, 2.0), at({20.1, 200}, 2.0),
                              at({730.9, 200}, 2.0), at({731.1, 200}, 2.0), at({300, 459.1}, 2.0),
                              -at({300, 200}, 3.0)});
  EXPECT_EQ(ids(frames[0]), (std::vector<LandmarkId>{1, 2, 5, 6}));
}

TEST_F(TrackLimits, TheRightCameraHasLimitsOfItsOwn) {
  // A third of a metre away the right camera, 11 cm aside, has another part of the scene in view.
  const auto frames = tracks({at({20, 240}, 0.35), at({400, 240}, 0.35)});
  ASSERT_EQ(frames[0].observations.size(), 2U);
  const int in_both = frames[0].observations[0].has_right + frames[0].observations[1].has_right;
  EXPECT_EQ(in_both, 1);
  options_.right_ratio = 0.0;
  const auto left_alone = tracks({at({400, 240}, 3.0)});
  ASSERT_EQ(left_alone[0].observations.size(), 1U);
  EXPECT_FALSE(left_alone[0].observations[0].has_right);
}

TEST_F(TrackLimits, AShareOfTheRightObservationsIsKept) {
  options_.right_ratio = 0.3;
  options_.max_tracks = 5000;
  const std::vector<Vector3d> points(4000, at({400, 240}, 5.0));
  const auto frames = tracks(points);
  int right = 0;
  for (const Observation& o : frames[0].observations) right += o.has_right;
  EXPECT_NEAR(right / 4000.0, 0.3, 5.0 * std::sqrt(0.21 / 4000.0));
}

TEST_F(TrackLimits, TracksThatRunGoBeforeNewOnes) {
  options_.max_tracks = 2;
  // Landmark 0 comes into view at the second pose, as the body turns to it.
  const std::vector<Vector3d> points = {at({-60, 240}, 4.0), at({300, 200}, 4.0),
                                        at({310, 220}, 4.0), at({320, 240}, 4.0)};
  Trajectory poses(2);
  poses[1].T_WB.t = at({200, 240}, 4.0) - at({367, 240}, 4.0);
  const auto frames = simulateTracks(poses, rig_, points, options_);
  EXPECT_EQ(ids(frames[0]), (std::vector<LandmarkId>{1, 2}));
  EXPECT_EQ(ids(frames[1]), (std::vector<LandmarkId>{1, 2}));
  options_.max_tracks = 4;
  EXPECT_EQ(ids(simulateTracks(poses, rig_, points, options_)[1]),
            (std::vector<LandmarkId>{0, 1, 2, 3}));
  options_.max_tracks = 0;
  EXPECT_TRUE(simulateTracks(poses, rig_, points, options_)[1].observations.empty());
  EXPECT_TRUE(simulateTracks({}, rig_, points, options_).empty());
}

TEST_F(TrackLimits, NoiseOfOneTrackDoesNotDependOnItsRightImage) {
  options_.sigma_px = 0.5;
  const std::vector<Vector3d> points = {at({300, 200}, 4.0), at({320, 240}, 4.0)};
  const auto both = tracks(points, 3);
  options_.right_ratio = 0.0;
  const auto left = tracks(points, 3);
  for (size_t k = 0; k < 3; ++k)
    for (size_t i = 0; i < 2; ++i)
      EXPECT_EQ(both[k].observations[i].left, left[k].observations[i].left);
}

TEST(ScatterLandmarks, CoversTheSixSidesOfItsBoxByTheirArea) {
  const std::vector<Vector3d> flight = {{0, 0, 0}, {8, 1, 2}, {3, -2, 1}};
  const auto points = scatterLandmarks(flight, 20'000, 3, 0.5);
  ASSERT_EQ(points.size(), 20'000U);
  const Vector3d low(-0.5, -2.5, -0.5), high(8.5, 1.5, 2.5), size = high - low;
  const Vector3d area(size.y() * size.z(), size.x() * size.z(), size.x() * size.y());
  int on[3][2] = {};
  for (const Vector3d& p : points) {
    ASSERT_TRUE((p.array() >= low.array()).all() && (p.array() <= high.array()).all());
    int sides = 0;
    for (int k = 0; k < 3; ++k) {
      on[k][0] += p[k] == low[k];
      on[k][1] += p[k] == high[k];
      sides += p[k] == low[k] || p[k] == high[k];
    }
    ASSERT_EQ(sides, 1);
  }
  for (int k = 0; k < 3; ++k)
    for (const int count : on[k]) {
      const double share = 0.5 * area[k] / area.sum();
      EXPECT_NEAR(count / 20'000.0, share, 5.0 * std::sqrt(share / 20'000.0)) << k;
    }
  EXPECT_TRUE(scatterLandmarks(flight, 0, 3).empty());
  EXPECT_EQ(scatterLandmarks(flight, 5, 3, 0.5)[4], points[4]);
  EXPECT_NE(scatterLandmarks(flight, 5, 4, 0.5)[4], points[4]);
}

}  // namespace
}  // namespace etalon
