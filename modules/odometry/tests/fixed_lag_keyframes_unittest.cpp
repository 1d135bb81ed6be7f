// When the fixed-lag odometry takes a keyframe, what it drops after an optimisation, and how it
// follows the noise of the pixels.

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"
#include "point_scene.h"

namespace etalon::fixed_lag {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

using Eigen::Vector3d;

/** Landmarks at `depth` m, seen from the origin and from `second`. */
struct Pair : PointScene {
  Tracks tracks;
  Tracks::Counts counts;
  explicit Pair(const SE3& second, size_t count = 40, double depth = 4.0,
                const TrackOptions& options = {})
      : PointScene(count, depth, depth), tracks(calibration, options) {
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    append(second);
    counts = tracks.associate(measured(seeFromNewest()), wellKnown(), &window);
  }
  bool wantsKeyframe(TimeNs later = 0) const {
    MeasuredFrame frame = measured(seeFromNewest());
    frame.t += later;
    return tracks.wantsKeyframe(frame, counts, window);
  }
};

TEST(WantsKeyframe, WhenTheMedianTrackHasMoved) {
  // At 4 m, x m aside are 458 x / 4 px: 12 px at 0.105 m. To the sides of the image the angle is
  // smaller, so that the median reaches it a little later.
  EXPECT_FALSE(Pair(movedTo(0.0, 0.09, 0.0)).wantsKeyframe());
  EXPECT_TRUE(Pair(movedTo(0.0, 0.14, 0.0)).wantsKeyframe());
  TrackOptions far;
  far.keyframe_parallax_px = 20.0;
  EXPECT_FALSE(Pair(movedTo(0.0, 0.14, 0.0), 40, 4.0, far).wantsKeyframe());
  // Half as far away it is half as much.
  EXPECT_FALSE(Pair(movedTo(0.0, 0.045, 0.0), 40, 2.0).wantsKeyframe());
  EXPECT_TRUE(Pair(movedTo(0.0, 0.07, 0.0), 40, 2.0).wantsKeyframe());
}

TEST(WantsKeyframe, NotByTurning) {
  // About the left camera's centre, so that nothing but the direction changes: 5 deg are 40 px.
  const SE3 T_BC = eurocCalibration().cameras[0].T_BC;
  const SE3 turned = T_BC * SE3(expSO3({0.06, -0.05, 0.04}), Vector3d::Zero()) * T_BC.inverse();
  EXPECT_FALSE(Pair(turned).wantsKeyframe());
  const SE3 turned_and_moved(turned.R, turned.t + Vector3d(0.0, 0.14, 0.0));
  EXPECT_TRUE(Pair(turned_and_moved).wantsKeyframe());
}

TEST(WantsKeyframe, ComparesWithTheLastKeyframe) {
  Pair pair(movedTo(0.0, 0.14, 0.0));
  pair.tracks.createLandmarks(pair.measured(pair.seeFromNewest()), &pair.window);
  EXPECT_FALSE(pair.wantsKeyframe());
}

TEST(WantsKeyframe, WhenTooFewTracksAreLandmarks) {
  Pair pair(movedTo(0.0, 0.01, 0.0));
  ASSERT_EQ(pair.counts.used, 40);
  pair.counts.used = 28;  // 0.7 of 40
  EXPECT_FALSE(pair.wantsKeyframe());
  pair.counts.used = 27;
  EXPECT_TRUE(pair.wantsKeyframe());
}

TEST(WantsKeyframe, NotWithAlmostNoTracksButWithAllNewOnes) {
  Pair few(movedTo(0.0, 0.5, 0.0), kLocatedBy - 1);
  few.counts.used = 0;
  EXPECT_FALSE(few.wantsKeyframe());
  // As many as locate a frame are enough. Where they are no landmarks yet, the next keyframe is
  // a while later, so that one camera sees them from different places.
  Pair enough(movedTo(0.0, 0.01, 0.0), kLocatedBy);
  EXPECT_FALSE(enough.wantsKeyframe());
  enough.counts.used = kLocatedBy - 1;
  EXPECT_FALSE(enough.wantsKeyframe());
  EXPECT_TRUE(enough.wantsKeyframe(kNanosecondsPerSecond / 3));
  // All tracks are new, whatever is said of landmarks.
  Pair pair(movedTo(0.0, 0.01, 0.0));
  TrackedFrame frame = pair.seeFromNewest();
  for (Observation& o : frame.observations) o.id += 1000;
  EXPECT_TRUE(pair.tracks.wantsKeyframe(pair.measured(frame), pair.counts, pair.window));
}

TEST(WantsKeyframe, DoesNotCompareOneCameraWithTheOther) {
  // The baseline alone would be 12 px of parallax at 4 m.
  Pair pair(movedTo(0.0, 0.01, 0.0));
  TrackedFrame frame = pair.seeFromNewest();
  for (size_t i = 0; i < 30; ++i) {
    frame.right_only.push_back({frame.observations[0].id, frame.observations[0].right});
    frame.observations.erase(frame.observations.begin());
  }
  EXPECT_FALSE(pair.tracks.wantsKeyframe(pair.measured(frame), pair.counts, pair.window));
}

TEST(DropOutliers, WhatFitsStaysAndWhatDoesNotLosesItsObservation) {
  Pair pair(movedTo(0.0, 0.1, 0.0));
  pair.append(movedTo(0.0, 0.2, 0.0));
  TrackedFrame frame = pair.seeFromNewest();
  // 4 sigma are a squared residual of 16: just within and just beyond.
  frame.observations[5].left.y() += 3.9 * PointScene::kSigmaPx;
  frame.observations[6].left.y() += 4.1 * PointScene::kSigmaPx;
  pair.tracks.associate(pair.measured(frame), 1e-2 * Eigen::Matrix<double, 6, 6>::Identity(),
                        &pair.window);
  pair.tracks.dropOutliers(RelativeViews(pair.window), &pair.window);
  EXPECT_EQ(pair.window.landmarks.size(), 40U);
  EXPECT_EQ(pair.window.landmarks.at(5).observations.size(), 3U);
  EXPECT_EQ(pair.window.landmarks.at(6).observations.size(), 2U);
  EXPECT_EQ(pair.window.landmarks.at(6).strikes, 1);
  EXPECT_EQ(pair.window.landmarks.at(5).strikes, 0);
}

TEST(DropOutliers, TwiceInARowEndsALandmarkAndOnceIsForgotten) {
  for (const bool in_a_row : {true, false}) {
    Pair pair(movedTo(0.0, 0.05, 0.0));
    for (int k = 2; k < 8; ++k) {
      pair.append(movedTo(0.0, 0.05 * k, 0.0));
      TrackedFrame frame = pair.seeFromNewest();
      if (k == 4 || k == (in_a_row ? 5 : 6)) frame.observations[6].left.y() += 3.0;
      pair.tracks.associate(pair.measured(frame), 1e-2 * Eigen::Matrix<double, 6, 6>::Identity(),
                            &pair.window);
      pair.tracks.dropOutliers(RelativeViews(pair.window), &pair.window);
    }
    EXPECT_EQ(pair.window.landmarks.count(6), in_a_row ? 0U : 1U);
    // A track that was no landmark does not become one again while it lasts.
    pair.tracks.createLandmarks(pair.measured(pair.seeFromNewest()), &pair.window);
    EXPECT_EQ(pair.window.landmarks.count(6), in_a_row ? 0U : 1U);
  }
}

TEST(DropOutliers, ALandmarkOfWhichMostDoesNotFitIsNone) {
  Pair pair(movedTo(0.0, 0.05, 0.0));
  for (int k = 2; k < 5; ++k) {
    pair.append(movedTo(0.0, 0.05 * k, 0.0));
    pair.tracks.associate(pair.measured(pair.seeFromNewest()), PointScene::wellKnown(),
                          &pair.window);
  }
  // Of five observations: three wrong ones are most, two are not.
  for (const LandmarkId id : {10, 11})
    for (size_t o = 1; o < (id == 10 ? 4U : 3U); ++o)
      pair.window.landmarks.at(id).observations[o].measurements[1].xy.y() += 0.05;
  pair.tracks.dropOutliers(RelativeViews(pair.window), &pair.window);
  EXPECT_EQ(pair.window.landmarks.count(10), 0U);
  ASSERT_EQ(pair.window.landmarks.count(11), 1U);
  EXPECT_EQ(pair.window.landmarks.at(11).observations.size(), 3U);
}

/** The next frame of a camera that repeats its image while the body has moved on. */
TEST(DropMisfittingImage, ARepeatedImageLeavesLandmarksAndTracksAsTheyWere) {
  Pair pair(movedTo(0.0, 0.1, 0.0));
  const TrackedFrame repeated = pair.seeFromNewest();
  const Matrix6d wide = 1e-2 * Matrix6d::Identity();
  for (int k = 2; k < 5; ++k) {
    pair.append(movedTo(0.0, 0.1 * k, 0.0));
    pair.window.states.back().keyframe = true;
    const MeasuredFrame frame = pair.measured(repeated);
    EXPECT_EQ(pair.tracks.associate(frame, wide, &pair.window).used, 40);
    EXPECT_TRUE(pair.tracks.dropMisfittingImage(frame, RelativeViews(pair.window), &pair.window));
    EXPECT_FALSE(pair.window.states.back().keyframe);
    EXPECT_EQ(pair.tracks.dropOutliers(RelativeViews(pair.window), &pair.window).used, 0);
  }
  pair.append(movedTo(0.0, 0.5, 0.0));
  const MeasuredFrame next = pair.measured(pair.seeFromNewest());
  pair.tracks.associate(next, wide, &pair.window);
  EXPECT_FALSE(pair.tracks.dropMisfittingImage(next, RelativeViews(pair.window), &pair.window));
  EXPECT_EQ(pair.tracks.dropOutliers(RelativeViews(pair.window), &pair.window).used, 40);
}

TEST(DropMisfittingImage, AQuarterThatFitsIsBelieved) {
  for (const size_t right : {9, 10}) {
    Pair pair(movedTo(0.0, 0.1, 0.0));
    pair.append(movedTo(0.0, 0.1, 0.0));
    TrackedFrame frame = pair.seeFromNewest();
    for (size_t i = right; i < 40; ++i) frame.observations[i].left.y() += 7.0;
    const MeasuredFrame measured = pair.measured(frame);
    pair.tracks.associate(measured, 1e-2 * Matrix6d::Identity(), &pair.window);
    EXPECT_EQ(pair.tracks.dropMisfittingImage(measured, RelativeViews(pair.window), &pair.window),
              right == 9);
  }
}

/** After seconds without images a track or two may go on in the wrong place. */
TEST(DropMisfittingImage, AFewWrongTracksSayNothingOfAnImageOfNewOnes) {
  for (const size_t old : {9, 10}) {
    Pair pair(movedTo(0.0, 0.1, 0.0));
    pair.append(movedTo(0.0, 0.1, 0.0));
    TrackedFrame frame = pair.seeFromNewest();
    for (size_t i = 0; i < 40; ++i)
      if (i < old)
        frame.observations[i].left.y() += 7.0;
      else
        frame.observations[i].id += 1000;
    const MeasuredFrame measured = pair.measured(frame);
    pair.tracks.associate(measured, 1e-2 * Matrix6d::Identity(), &pair.window);
    EXPECT_EQ(pair.tracks.dropMisfittingImage(measured, RelativeViews(pair.window), &pair.window),
              old == 10);
  }
}

/** The variance after so many frames of pixels with `factor` times the noise that is believed, all
 * of which are kept. */
double varianceAfter(int frames, double factor, TrackOptions options = {}, size_t points = 300,
                     bool first_is_retained = false) {
  options.chi2_outlier = 1e9;
  Pair pair(movedTo(0.0, 0.05, 0.0), points, 4.0, options);
  pair.window.states.front().retained = first_is_retained;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, factor);
  for (auto& [id, landmark] : pair.window.landmarks)
    landmark.observations.push_back(landmark.observations.back());
  for (int k = 0; k < frames; ++k) {
    // The residual's whitening takes the noise to the direction; the landmark stays where it is.
    for (auto& [id, landmark] : pair.window.landmarks)
      for (LandmarkObservation& o : landmark.observations)
        for (size_t c = 0; c < 2; ++c) {
          if (pair.window.states[o.state].retained) continue;  // exact
          ReprojectionMeasurement& m = o.measurements[c];
          const CameraCalibration& camera = pair.calibration.cameras[c];
          const SE3& T_WB = pair.window.states[o.state].now.T_WB;
          const auto pixel = camera.model.project((T_WB * camera.T_BC).inverse() * pair.points[id]);
          const Eigen::Vector2d noise(normal(random), normal(random));
          if (pixel)
            m = *makeMeasurement(camera.model, *pixel + PointScene::kSigmaPx * noise,
                                 PointScene::kSigmaPx);
        }
    Window judged = pair.window;
    pair.tracks.followNoise(pair.tracks.dropOutliers(RelativeViews(judged), &judged).squares,
                            &pair.window);
  }
  return pair.window.pixel_variance;
}

TEST(FollowNoise, GoesToTheVarianceOfTheResidualsWithinSomeFiftyFrames) {
  // Of three stereo observations the landmark is thought to have taken a quarter; here it has taken
  // nothing: the residuals' variance over 3/4. After n frames (1 - 0.98^n) of the way is done.
  const double wanted = 4.0 / 0.75;
  const double after_50 = 1.0 + (wanted - 1.0) * (1.0 - std::pow(0.98, 50));
  EXPECT_NEAR(varianceAfter(50, 2.0), after_50, 0.03 * after_50);
  EXPECT_NEAR(varianceAfter(1, 2.0), 1.0 + 0.02 * (wanted - 1.0), 0.01);
}

TEST(FollowNoise, WhatIsFoundInOldViewsDoesNotCount) {
  // Two stereo observations are left, of whose eight coordinates the landmark is thought to take three.
  const double wanted = 4.0 / (1.0 - 3.0 / 8.0);
  const double after_50 = 1.0 + (wanted - 1.0) * (1.0 - std::pow(0.98, 50));
  EXPECT_NEAR(varianceAfter(50, 2.0, {}, 300, true), after_50, 0.03 * after_50);
}

TEST(FollowNoise, StopsAtTheLeastAndDoesNothingWithFewPixels) {
  TrackOptions options;
  options.least_sigma_px = 0.9 * options.sigma_px;
  EXPECT_DOUBLE_EQ(varianceAfter(50, 0.1, options), 0.81);
  EXPECT_EQ(varianceAfter(5, 3.0, {}, 16), 1.0);  // 96 pixels
  EXPECT_GT(varianceAfter(5, 3.0, {}, 20), 1.1);
}

}  // namespace
}  // namespace etalon::fixed_lag
