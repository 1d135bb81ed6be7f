#include "epipolar/epipolar_pairs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>
#include <tuple>
#include <vector>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using testing::SyntheticWindow;

const SyntheticWindow& window() {
  static const SyntheticWindow made = testing::makeSyntheticWindow({});
  return made;
}

TEST(EpipolarPairs, AllPairsOfBothCamerasByIncreasingSpan) {
  const EpipolarPairs found = collectEpipolarPairs(window().calibration, window().keyframes(), {});
  std::set<std::tuple<int, int, int>> seen;
  int span = 1;
  for (const EpipolarPair& pair : found.pairs) {
    EXPECT_LT(pair.i, pair.j);
    EXPECT_GE(pair.j - pair.i, span);
    span = pair.j - pair.i;
    EXPECT_TRUE(seen.insert({pair.i, pair.j, pair.camera}).second);
    EXPECT_GE(pair.matches.size(), 15U);
  }
  EXPECT_EQ(seen.size(), 2U * 45U);
}

TEST(EpipolarPairs, AsPublishedOneCameraAndNeighboursAlone) {
  NormalEpipolarBiasOptions options;
  options.all_pairs = options.both_cameras = false;
  const EpipolarPairs found =
      collectEpipolarPairs(window().calibration, window().keyframes(), options);
  ASSERT_EQ(found.pairs.size(), 9U);
  for (const EpipolarPair& pair : found.pairs) {
    EXPECT_EQ(pair.j, pair.i + 1);
    EXPECT_EQ(pair.camera, 0);
  }
}

TEST(EpipolarPairs, MatchesAreTheBearingsOfOneLandmark) {
  const EpipolarPairs found = collectEpipolarPairs(window().calibration, window().keyframes(), {});
  for (const EpipolarPair& pair : found.pairs) {
    const CameraCalibration& camera = window().calibration.cameras[pair.camera];
    const SE3 T_CiCj = (window().truth[pair.i].T_WB * camera.T_BC).inverse() *
                       (window().truth[pair.j].T_WB * camera.T_BC);
    for (const EpipolarMatch& match : pair.matches) {
      EXPECT_NEAR(match.f_i.norm(), 1.0, 1e-12);
      // The bearings and the step lie in one plane.
      EXPECT_NEAR(T_CiCj.t.dot(match.f_i.cross(T_CiCj.R * match.f_j)), 0.0, 1e-9);
      EXPECT_GE(match.observation_i, 0);
      EXPECT_LT(match.observation_j, found.observations);
      EXPECT_NE(match.observation_i, match.observation_j);
    }
  }
}

TEST(EpipolarPairs, AnObservationHasOneNumberInAllItsPairs) {
  const EpipolarPairs found = collectEpipolarPairs(window().calibration, window().keyframes(), {});
  std::vector<Eigen::Vector3d> bearing(found.observations, Eigen::Vector3d::Zero());
  for (const EpipolarPair& pair : found.pairs)
    for (const EpipolarMatch& match : pair.matches) {
      Eigen::Vector3d& first = bearing[match.observation_i];
      if (first.isZero()) first = match.f_i;
      EXPECT_EQ(first, match.f_i);
    }
}

TEST(EpipolarPairs, LongPairsAreThinnedOutEvenlyAndNeighboursNever) {
  NormalEpipolarBiasOptions options;
  options.max_matches = 20;
  const EpipolarPairs found =
      collectEpipolarPairs(window().calibration, window().keyframes(), options);
  const EpipolarPairs whole = collectEpipolarPairs(window().calibration, window().keyframes(), {});
  ASSERT_EQ(found.pairs.size(), whole.pairs.size());
  for (size_t i = 0; i < found.pairs.size(); ++i) {
    const EpipolarPair& pair = found.pairs[i];
    if (pair.j == pair.i + 1) {
      EXPECT_EQ(pair.matches.size(), whole.pairs[i].matches.size());
    } else {
      EXPECT_EQ(pair.matches.size(), 20U);
      // From the first on, and not the first twenty.
      EXPECT_EQ(pair.matches.front().f_i, whole.pairs[i].matches.front().f_i);
      EXPECT_GT(pair.matches.back().observation_i, pair.matches.front().observation_i + 20);
    }
  }
}

TEST(EpipolarPairs, CountTheNeighboursThatShareLeast) {
  std::vector<TrackedFrame> frames;
  for (const TrackedFrame* frame : window().keyframes()) frames.push_back(*frame);
  const auto counted = [&] {
    std::vector<const TrackedFrame*> pointers;
    for (const TrackedFrame& frame : frames) pointers.push_back(&frame);
    return collectEpipolarPairs(window().calibration, pointers, {});
  };
  EXPECT_GT(counted().fewest_matches, 50);
  frames[4].observations.resize(10);
  const EpipolarPairs few = counted();
  EXPECT_LE(few.fewest_matches, 10);
  for (const EpipolarPair& pair : few.pairs) EXPECT_TRUE(pair.i != 4 && pair.j != 4);
  frames[4].observations.clear();
  EXPECT_EQ(counted().fewest_matches, 0);
}

}  // namespace
}  // namespace etalon
