#include "etalon/frontend/stereo_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "textured_wall.h"

namespace etalon {
namespace {

constexpr TimeNs kFramePeriod = 50'000'000;  // 20 Hz

/** Moves sideways, forwards and turns: poses of consecutive frames. */
std::vector<SE3> flight(int frames) {
  std::vector<SE3> T_WB;
  for (int i = 0; i < frames; ++i)
    T_WB.emplace_back(expSO3(i * Eigen::Vector3d(0.01, -0.02, 0.015)),
                      i * Eigen::Vector3d(0.03, 0.01, 0.02));
  return T_WB;
}

std::vector<TrackedFrame> run(StereoTracker* tracker, const TexturedWall& wall,
                              const std::vector<SE3>& T_WB) {
  std::vector<TrackedFrame> frames;
  for (size_t i = 0; i < T_WB.size(); ++i) {
    const auto [left, right] = wall.pair(T_WB[i]);
    const Eigen::Matrix3d R_prev_cur = T_WB[i == 0 ? 0 : i - 1].R.transpose() * T_WB[i].R;
    frames.push_back(
        tracker->track(static_cast<TimeNs>(i) * kFramePeriod, left, right, R_prev_cur));
  }
  return frames;
}

TEST(StereoTracker, FollowsPointsToATenthOfAPixel) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 3.0);
  const std::vector<SE3> T_WB = flight(6);
  StereoTracker tracker(rig, StereoTrackerOptions{});
  const std::vector<TrackedFrame> frames = run(&tracker, wall, T_WB);
  std::map<LandmarkId, Eigen::Vector3d> points;
  for (const Observation& o : frames[0].observations)
    points[o.id] = wall.pointBehind(o.left, T_WB[0]);
  std::vector<double> errors;
  for (const Observation& o : frames.back().observations)
    if (points.count(o.id))
      errors.push_back((wall.pixelOf(points[o.id], 0, T_WB.back()) - o.left).norm());
  // 3 cm and 1.5 deg a frame: most of the corners stay in view.
  EXPECT_GT(errors.size(), 100U);
  // The images are noise-free but for rounding to gray levels; the patch is taken for shifted, not
  // for tilted.
  EXPECT_LT(quantile(errors, 0.5), 0.05);
  EXPECT_LT(quantile(errors, 0.9), 0.1);
}

TEST(StereoTracker, FindsRightPixelsToATenthOfAPixel) {
  const StereoInertialCalibration rig = smallRig();
  // The nearest: 46 px of disparity in an image 376 px wide, more than half the patch at the
  // coarsest pyramid level.
  for (const double depth_m : {0.55, 1.5, 20.0}) {
    const TexturedWall wall(rig, depth_m);
    StereoTracker tracker(rig, StereoTrackerOptions{});
    const SE3 T_WB;
    const TrackedFrame frame = run(&tracker, wall, {T_WB}).front();
    std::vector<double> errors;
    int in_view = 0;
    for (const Observation& o : frame.observations) {
      const Eigen::Vector2d truth = wall.pixelOf(wall.pointBehind(o.left, T_WB), 1, T_WB);
      in_view += rig.cameras[1].model.inImage(truth, 10.0);
      if (o.has_right) errors.push_back((truth - o.right).norm());
    }
    ASSERT_GT(in_view, 100) << depth_m;
    EXPECT_GT(static_cast<double>(errors.size()), 0.9 * in_view) << depth_m;
    EXPECT_LT(quantile(errors, 0.5), 0.05) << depth_m;
    EXPECT_LT(quantile(errors, 0.95), 0.1) << depth_m;
  }
}

TEST(StereoTracker, ATrackEndsWhereItsPatchShowsSomethingElse) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0), other(rig, 2.0, 1.0, 2);
  StereoTracker tracker(rig, StereoTrackerOptions{});
  constexpr int kFrames = 25;
  std::set<LandmarkId> first, last;
  for (int i = 0; i < kFrames; ++i) {
    // From frame to frame little changes, and KLT goes on; at the end it is another wall.
    const double share = static_cast<double>(i) / (kFrames - 1);
    std::array<cv::Mat, 2> blend;
    for (size_t c = 0; c < 2; ++c)
      cv::addWeighted(wall.image(c, SE3()), 1.0 - share, other.image(c, SE3()), share, 0.0,
                      blend[c]);
    const TrackedFrame frame =
        tracker.track(i * kFramePeriod, blend[0], blend[1], Eigen::Matrix3d::Identity());
    for (const Observation& o : frame.observations) (i == 0 ? first : last).insert(o.id);
    if (i + 1 < kFrames) last.clear();
  }
  EXPECT_GT(first.size(), 100U);
  EXPECT_GT(last.size(), 50U);
  std::vector<LandmarkId> common;
  std::set_intersection(first.begin(), first.end(), last.begin(), last.end(),
                        std::back_inserter(common));
  EXPECT_LE(common.size(), first.size() / 50);
}

TEST(StereoTracker, TracksLiveOnInTheRightImageWhileTheLeftLensIsCovered) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 3.0);
  const std::vector<SE3> T_WB = flight(8);
  StereoTracker tracker(rig, StereoTrackerOptions{});
  std::map<LandmarkId, Eigen::Vector3d> points;
  std::vector<TrackedFrame> frames;
  for (size_t i = 0; i < T_WB.size(); ++i) {
    auto [left, right] = wall.pair(T_WB[i]);
    if (i >= 3 && i < 6) left.setTo(20);
    const Eigen::Matrix3d R_prev_cur = T_WB[i == 0 ? 0 : i - 1].R.transpose() * T_WB[i].R;
    frames.push_back(tracker.track(static_cast<TimeNs>(i) * kFramePeriod, left, right, R_prev_cur));
    if (i > 2) continue;
    for (const Observation& o : frames.back().observations)
      points.emplace(o.id, wall.pointBehind(o.left, T_WB[i]));
  }
  for (size_t i = 3; i < 6; ++i) {
    EXPECT_TRUE(frames[i].observations.empty()) << i;
    std::vector<double> errors;
    for (const RightObservation& o : frames[i].right_only)
      if (points.count(o.id))
        errors.push_back((wall.pixelOf(points[o.id], 1, T_WB[i]) - o.right).norm());
    EXPECT_GT(errors.size(), 80U) << i;
    EXPECT_LT(quantile(errors, 0.5), 0.1) << i;
    EXPECT_LT(quantile(errors, 0.9), 0.2) << i;
  }
  for (size_t i = 6; i < 8; ++i) {  // the same landmarks, in both images
    std::vector<double> errors;
    for (const Observation& o : frames[i].observations)
      if (points.count(o.id))
        errors.push_back((wall.pixelOf(points[o.id], 0, T_WB[i]) - o.left).norm());
    EXPECT_GT(errors.size(), 60U) << i;
    EXPECT_LT(quantile(errors, 0.5), 0.1) << i;
  }
}

TEST(StereoTracker, GyroBridgesFastRotation) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 3.0);
  // 12 deg about the optical axis and 9 deg across it in one frame: up to 60 px.
  const SE3 T_WB(expSO3({0.1, 0.12, 0.2}), {0.02, 0.0, 0.0});
  const auto first = wall.pair(SE3());
  const auto second = wall.pair(T_WB);
  std::array<int, 2> followed{};
  StereoTrackerOptions options;
  options.klt_levels =
      1;  // the pyramid alone bridges some 10 px then: what is followed, the gyro's rotation finds
  for (const bool gyro : {false, true}) {
    StereoTracker tracker(rig, options);
    tracker.track(0, first.first, first.second, Eigen::Matrix3d::Identity());
    tracker.track(kFramePeriod, second.first, second.second,
                  gyro ? T_WB.R : Eigen::Matrix3d::Identity().eval());
    followed[gyro] = tracker.statistics().tracked;
  }
  EXPECT_GT(followed[1], 80);
  EXPECT_GT(followed[1], 2 * followed[0]);
}

TEST(StereoTracker, StatisticsAndIdsAreConsistent) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  StereoTrackerOptions options;
  options.max_features = 120;
  options.anchor_patience = 0;  // a track without an observation would come back
  StereoTracker tracker(rig, options);
  const std::vector<SE3> T_WB = flight(5);
  std::set<LandmarkId> seen, previous;
  for (size_t i = 0; i < T_WB.size(); ++i) {
    const auto [left, right] = wall.pair(T_WB[i]);
    const TrackedFrame frame = tracker.track(static_cast<TimeNs>(i) * kFramePeriod, left, right,
                                             T_WB[i == 0 ? 0 : i - 1].R.transpose() * T_WB[i].R);
    EXPECT_EQ(frame.t, static_cast<TimeNs>(i) * kFramePeriod);
    const TrackingStatistics& s = tracker.statistics();
    EXPECT_EQ(static_cast<size_t>(s.tracked + s.added), frame.observations.size());
    EXPECT_EQ(static_cast<size_t>(s.tracked + s.lost), previous.size());
    EXPECT_LE(frame.observations.size(), 120U);
    std::set<LandmarkId> now;
    int with_right = 0;
    for (const Observation& o : frame.observations) {
      EXPECT_TRUE(now.empty() || o.id > *now.rbegin()) << "ids in increasing order";
      EXPECT_TRUE(previous.count(o.id) || !seen.count(o.id)) << "id " << o.id << " came back";
      EXPECT_TRUE(rig.cameras[0].model.inImage(o.left, options.border_px));
      now.insert(o.id);
      with_right += o.has_right;
    }
    EXPECT_EQ(with_right, s.with_stereo);
    for (size_t a = 0; a < frame.observations.size(); ++a)
      for (size_t b = 0; b < a; ++b)  // the mask is drawn around rounded pixels: up to 1.5 px less
        EXPECT_GT((frame.observations[a].left - frame.observations[b].left).norm(),
                  options.min_distance_px - 1.5);
    seen.insert(now.begin(), now.end());
    previous = now;
  }
}

TEST(StereoTracker, FollowsFewerLandmarksInFlight) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const SE3 still = flight(1).front();
  const auto [left, right] = wall.pair(still);
  const auto observed = [&](int flight_features, std::vector<bool> in_flight) {
    StereoTrackerOptions options;
    options.max_features = 120;
    options.flight_features = flight_features;
    StereoTracker tracker(rig, options);
    std::vector<size_t> counts;
    for (const bool flies : in_flight)
      counts.push_back(tracker
                           .track(static_cast<TimeNs>(counts.size()) * kFramePeriod, left, right,
                                  Eigen::Matrix3d::Identity(), flies)
                           .observations.size());
    return counts;
  };
  const std::vector<size_t> before = observed(60, {false, true});
  EXPECT_GT(before[0], 80U);
  EXPECT_GT(before[1], 80U);  // those that there are go on
  const std::vector<size_t> from_the_first = observed(60, {true, false});
  EXPECT_GT(from_the_first[0], 40U);
  EXPECT_LE(from_the_first[0], 60U);
  EXPECT_GT(from_the_first[1], 80U);
  EXPECT_EQ(observed(1000, {true}), observed(120, {false}));  // at most max_features
}

TEST(StereoTracker, SameImagesSameTracksWhateverTheThreads) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const std::vector<SE3> T_WB = flight(5);
  const int threads_before = cv::getNumThreads();
  std::vector<std::vector<TrackedFrame>> runs;
  for (const int threads : {1, 2, 1}) {
    cv::setNumThreads(threads);
    cv::theRNG().state = static_cast<uint64_t>(1234 + runs.size());  // must not matter
    StereoTracker tracker(rig, StereoTrackerOptions{});
    runs.push_back(run(&tracker, wall, T_WB));
  }
  cv::setNumThreads(threads_before);
  for (size_t r = 1; r < runs.size(); ++r)
    for (size_t i = 0; i < T_WB.size(); ++i) {
      const auto &a = runs[0][i].observations, &b = runs[r][i].observations;
      ASSERT_EQ(a.size(), b.size());
      for (size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k].id, b[k].id);
        EXPECT_EQ(a[k].left, b[k].left);  // bit for bit
        ASSERT_EQ(a[k].has_right, b[k].has_right);
        if (a[k].has_right) {
          EXPECT_EQ(a[k].right, b[k].right);
        }
      }
    }
}

TEST(StereoTracker, FlatWallGivesNoLandmarks) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0, 0.02);  // a gray level or two of contrast
  StereoTracker tracker(rig, StereoTrackerOptions{});
  for (const TrackedFrame& frame : run(&tracker, wall, flight(3)))
    EXPECT_LT(frame.observations.size(), 20U);
}

TEST(StereoTrackerOptions, AreAllDeclared) {
  StereoTrackerOptions options;
  ParameterSet parameters("frontend");
  options.declare(parameters);
  IniFile ini;
  ini.set("frontend", "max_features", "77", "test");
  parameters.read(ini);
  EXPECT_EQ(options.max_features, 77);
  ini.set("frontend", "klt_levels", "99", "test");
  EXPECT_THROW(parameters.read(ini), ConfigError);
  EXPECT_EQ(parameters.describe().size(), 20U);  // one a member
}

}  // namespace
}  // namespace etalon
