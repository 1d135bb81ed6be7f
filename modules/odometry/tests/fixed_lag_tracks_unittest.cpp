// What the fixed-lag odometry believes of its tracks, one decision at a time.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "../src/fixed_lag/tracks.h"
#include "etalon/core/so3.h"
#include "point_scene.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/** A first keyframe with landmarks, and a second state that nothing has been said of. */
struct TwoStates : PointScene {
  Tracks tracks;
  explicit TwoStates(size_t count, const TrackOptions& options = {},
                     const SE3& second = movedTo(0.1, 0.0, 0.0))
      : PointScene(count), tracks(calibration, options) {
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    append(second);
  }
  Tracks::Counts associate(const TrackedFrame& frame) {
    return tracks.associate(measured(frame), wellKnown(), &window);
  }
};

TEST(Measure, SortsWhatTheRightCameraAloneSeesAmongTheOthers) {
  const PointScene scene(6);
  TrackedFrame frame = scene.seeFromNewest();
  ASSERT_EQ(frame.observations.size(), 6U);
  const Observation taken = frame.observations[2];
  frame.observations.erase(frame.observations.begin() + 2);
  frame.right_only.push_back({taken.id, taken.right});
  frame.t = 77;
  const MeasuredFrame measured = scene.measured(frame);
  EXPECT_EQ(measured.t, 77);
  ASSERT_EQ(measured.tracks.size(), 6U);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(measured.tracks[i].id, static_cast<LandmarkId>(i));
    EXPECT_EQ(measured.tracks[i].has_left, i != 2);
    EXPECT_TRUE(measured.tracks[i].has_right);
  }
  // The direction is the right camera's.
  const Vector3d p_C = scene.calibration.cameras[1].T_BC.inverse() * scene.points[2];
  const Vector3d ray = measured.tracks[2].measurements[1].ray();
  EXPECT_LT(ray.cross(p_C.normalized()).norm(), 1e-9);
}

TEST(Measure, LeavesOutWhatTheLensDoesNotShow) {
  PointScene scene(3);
  // EuRoC's lens without its second coefficient is not one-to-one far outside of the image.
  for (CameraCalibration& camera : scene.calibration.cameras)
    camera.model = camera.model.with("k2", 0.0);
  TrackedFrame frame = scene.seeFromNewest();
  frame.observations[0].left = {1e5, 1e5};
  frame.observations[1].right = {1e5, 1e5};
  frame.right_only.push_back({9, {1e5, 1e5}});
  const MeasuredFrame measured = scene.measured(frame);
  ASSERT_EQ(measured.tracks.size(), 2U);
  EXPECT_EQ(measured.tracks[0].id, 1);
  EXPECT_FALSE(measured.tracks[0].has_right);
  EXPECT_TRUE(measured.tracks[1].has_right);
}

TEST(Tracks, LandmarksOfOneStereoFrameAreWhereThePointsAre) {
  PointScene scene(50);
  scene.window.states[0].now.T_WB = SE3(expSO3({0.02, 0.03, -0.04}), {0.1, 0.2, 0.3});
  Tracks(scene.calibration, {})
      .createLandmarks(scene.measured(scene.seeFromNewest()), &scene.window);
  ASSERT_GT(scene.window.landmarks.size(), 45U);
  for (const auto& [id, landmark] : scene.window.landmarks) {
    EXPECT_EQ(landmark.id, id);
    EXPECT_EQ(landmark.host, 0);
    ASSERT_EQ(landmark.observations.size(), 1U);
    const Vector3d p_W = scene.window.states[0].now.T_WB * landmark.in_host.position();
    EXPECT_LT((p_W - scene.points[id]).norm(), 1e-6) << id;
  }
}

TEST(Tracks, ANewLandmarkIsKnownAsWellAsItsPixelsTell) {
  // At 40 m half a pixel of disparity is 40 % of the distance; a metre aside that is a few pixels.
  PointScene scene(200, 40.0, 40.0);
  Tracks tracks(scene.calibration, {});
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, PointScene::kSigmaPx);
  const auto see = [&] {
    TrackedFrame frame = scene.seeFromNewest();
    for (Observation& o : frame.observations) {
      o.left += Vector2d(noise(random), noise(random));
      o.right += Vector2d(noise(random), noise(random));
    }
    return scene.measured(frame);
  };
  tracks.createLandmarks(see(), &scene.window);
  scene.append(movedTo(0.0, 1.0, 0.0));
  const Tracks::Counts counts = tracks.associate(see(), PointScene::wellKnown(), &scene.window);
  ASSERT_GT(counts.used, 100);
  EXPECT_LE(counts.gated, 1);
}

TEST(Tracks, OneCameraNeedsASecondKeyframeForALandmark) {
  PointScene scene(20);
  Tracks tracks(scene.calibration, {});
  const auto seeLeft = [&] {
    TrackedFrame frame = scene.seeFromNewest();
    for (Observation& o : frame.observations) o.has_right = false;
    return scene.measured(frame);
  };
  tracks.createLandmarks(seeLeft(), &scene.window);
  EXPECT_TRUE(scene.window.landmarks.empty());
  // The state may have got another index since: what was seen goes with its serial.
  scene.append(movedTo(0.0, 0.1, 0.0));
  scene.append(movedTo(0.0, 0.6, 0.0));
  scene.window.states.erase(scene.window.states.begin() + 1);
  scene.window.reindex();
  tracks.createLandmarks(seeLeft(), &scene.window);
  ASSERT_GT(scene.window.landmarks.size(), 15U);
  for (const auto& [id, landmark] : scene.window.landmarks) {
    EXPECT_EQ(landmark.host, 1);
    EXPECT_EQ(landmark.host_serial, 2);
    ASSERT_EQ(landmark.observations.size(), 2U);
    EXPECT_EQ(landmark.observations[0].state, 0);
    EXPECT_EQ(landmark.observations[1].state, 1);
    const Vector3d p_W = scene.window.states[1].now.T_WB * landmark.in_host.position();
    EXPECT_LT((p_W - scene.points[id]).norm(), 1e-6) << id;
  }
}

TEST(Tracks, OnlyKnownLandmarksGetObservations) {
  TwoStates scene(30);
  scene.window.landmarks.erase(7);
  const Tracks::Counts counts = scene.associate(scene.seeFromNewest());
  EXPECT_EQ(counts.used, 29);
  EXPECT_EQ(counts.gated, 0);
  EXPECT_EQ(scene.window.landmarks.count(7), 0U);
  for (const auto& [id, landmark] : scene.window.landmarks) {
    ASSERT_EQ(landmark.observations.size(), 2U) << id;
    EXPECT_TRUE(landmark.seenIn(1));
    EXPECT_EQ(landmark.observations[1].state, 1);
  }
}

TEST(Tracks, TheGateIsAsWideAsTheStateIsUncertain) {
  // Moved by 20 sigma of a pixel (7 px): wrong where the pose is known, possible where it may be
  // off by 5 cm (10 px at 2 m).
  const auto countsWith = [](double sigma_m) {
    TwoStates scene(30);
    TrackedFrame frame = scene.seeFromNewest();
    for (size_t i = 0; i < 5; ++i) {
      frame.observations[i].left.y() += 7.0;
      frame.observations[i].right.y() += 7.0;
    }
    Eigen::Matrix<double, 6, 6> P = PointScene::wellKnown();
    P.bottomRightCorner<3, 3>().diagonal().setConstant(sigma_m * sigma_m);
    return scene.tracks.associate(scene.measured(frame), P, &scene.window);
  };
  EXPECT_EQ(countsWith(1e-4).gated, 5);
  EXPECT_EQ(countsWith(1e-4).used, 25);
  EXPECT_EQ(countsWith(0.05).gated, 0);
}

TEST(Tracks, AWrongRightPixelAloneIsEnoughToBeLeftOut) {
  TwoStates scene(30);
  TrackedFrame frame = scene.seeFromNewest();
  frame.observations[3].right.y() += 7.0;
  EXPECT_EQ(scene.associate(frame).gated, 1);
  EXPECT_FALSE(scene.window.landmarks.at(3).seenIn(1));
}

TEST(Tracks, WhereMostDisagreeThePredictionIsWrong) {
  for (const size_t wrong : {15, 16}) {
    TwoStates scene(30);
    TrackedFrame frame = scene.seeFromNewest();
    for (size_t i = 0; i < wrong; ++i) frame.observations[i].left.y() += 7.0;
    const Tracks::Counts counts = scene.associate(frame);
    EXPECT_EQ(counts.used, wrong == 15 ? 15 : 30);
    EXPECT_EQ(counts.gated, wrong == 15 ? 15 : 0);
  }
}

TEST(Tracks, ATrackThatIsWrongTwiceIsNotBelievedUntilItEnds) {
  TwoStates scene(30);
  const auto wrongAt3 = [&] {
    TrackedFrame frame = scene.seeFromNewest();
    frame.observations[3].left.y() += 7.0;
    return frame;
  };
  EXPECT_EQ(scene.associate(wrongAt3()).gated, 1);
  scene.append(movedTo(0.1, 0.0, 0.0));
  EXPECT_EQ(scene.associate(wrongAt3()).gated, 1);
  // From now on it is neither used nor counted, though it is right again, and becomes no landmark.
  scene.append(movedTo(0.1, 0.0, 0.0));
  Tracks::Counts counts = scene.associate(scene.seeFromNewest());
  EXPECT_EQ(counts.used, 29);
  EXPECT_EQ(counts.gated, 0);
  scene.window.landmarks.erase(3);
  scene.tracks.createLandmarks(scene.measured(scene.seeFromNewest()), &scene.window);
  EXPECT_EQ(scene.window.landmarks.count(3), 0U);
  // An image without tracks, and one that misses this track, do not end it.
  const auto isLandmarkAgain = [&] {
    scene.tracks.createLandmarks(scene.measured(scene.seeFromNewest()), &scene.window);
    return scene.window.landmarks.count(3) > 0;
  };
  const auto miss = [&](int frames) {
    for (int k = 0; k < frames; ++k) {
      scene.append(movedTo(0.1, 0.0, 0.0));
      TrackedFrame without = scene.seeFromNewest();
      without.observations.erase(without.observations.begin() + 3);
      scene.associate(without);
    }
  };
  for (int k = 0; k < 20; ++k) scene.associate(TrackedFrame());
  miss(10);
  EXPECT_FALSE(isLandmarkAgain());
  miss(2);
  EXPECT_TRUE(isLandmarkAgain());
}

}  // namespace
}  // namespace etalon::fixed_lag
