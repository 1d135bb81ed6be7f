// What stereo odometry keeps from frame to frame: velocity, window, landmarks.

#include <gtest/gtest.h>

#include "etalon/core/so3.h"
#include "etalon/odometry/stereo_odometry.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::SyntheticWindow;

/** Exact tracks of a moving platform at 20 Hz, in W. */
class StereoOdometryState : public ::testing::Test {
 protected:
  StereoOdometryState() {
    testing::SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.keyframe_rate_hz = 20.0;
    options.frames_per_keyframe = 1;
    window_ = testing::makeSyntheticWindow(options);
  }
  const SE3& truth(size_t k) const { return window_.truth[k].T_WB; }
  Matrix3d turn(size_t k) const { return truth(k - 1).R.transpose() * truth(k).R; }
  StereoOdometry odometry(const StereoOdometryOptions& options = {}) const {
    return StereoOdometry(window_.calibration, options);
  }
  /** Begins with the truth of frame 0. */
  void begin(StereoOdometry* odometry) const {
    odometry->begin(window_.frames[0], truth(0), window_.truth[0].v_WB);
  }
  /** After frames 0 and 1; it keeps the last velocity for so long. */
  StereoOdometry inMotion(double max_prediction_s) const {
    StereoOdometryOptions options;
    options.max_prediction_s = max_prediction_s;
    StereoOdometry odometry = this->odometry(options);
    begin(&odometry);
    odometry.track(window_.frames[1], turn(1), true);
    return odometry;
  }
  /** The mean velocity from frame 0 to frame k, m/s. */
  Vector3d velocityTo(size_t k) const {
    return (truth(k).t - truth(0).t) / secondsBetween(window_.frames[0].t, window_.frames[k].t);
  }
  static double error(const SE3& a, const SE3& b) {
    return (a.t - b.t).norm() + logSO3(a.R.transpose() * b.R).norm();
  }

  SyntheticWindow window_;
};

TEST_F(StereoOdometryState, BeginsWhereItIsToldAndForgetsWhatWas) {
  StereoOdometry odometry = this->odometry();
  for (size_t k = 0; k < 3; ++k)
    odometry.track(window_.frames[k], k ? turn(k) : Matrix3d::Identity(), true);
  odometry.begin(window_.frames[3], truth(3), window_.truth[3].v_WB);
  EXPECT_EQ(odometry.pose().t, truth(3).t);
  EXPECT_EQ(odometry.keyframes().size(), 1U);
  for (const auto& [id, p] : odometry.landmarks())
    EXPECT_LT((p - window_.landmarks[id]).norm(), 1e-5) << id;
  // From there on in the same world, with the velocity for the prediction.
  const double dt = secondsBetween(window_.frames[3].t, window_.frames[4].t);
  EXPECT_LT(
      (odometry.predict(window_.frames[4].t, turn(4)).t - truth(3).t - dt * window_.truth[3].v_WB)
          .norm(),
      1e-12);
  const auto result = odometry.track(window_.frames[4], turn(4), false);
  EXPECT_TRUE(result.located);
  EXPECT_LT(error(result.T_VB, truth(4)), 1e-5);
  EXPECT_LT(error(odometry.pose(), truth(4)), 1e-5);
}

TEST_F(StereoOdometryState, AFrameThatIsNoKeyframeAddsNoLandmarks) {
  StereoOdometry odometry = this->odometry();
  begin(&odometry);
  TrackedFrame frame = window_.frames[1];
  frame.observations.back().id = 9'999;
  const auto before = odometry.landmarks();
  odometry.track(frame, turn(1), false);
  EXPECT_EQ(odometry.landmarks().size(), before.size());
  EXPECT_EQ(odometry.keyframes().size(), 1U);
  // As a keyframe it does; but not from one camera.
  frame.observations.front().id = -5;
  frame.observations.front().has_right = false;
  odometry.track(frame, Matrix3d::Identity(), true);
  EXPECT_EQ(odometry.landmarks().count(9'999), 1U);
  EXPECT_EQ(odometry.landmarks().count(-5), 0U);
  EXPECT_EQ(odometry.keyframes().size(), 2U);
}

TEST_F(StereoOdometryState, TheWindowIsAsLongAsConfigured) {
  StereoOdometryOptions options;
  options.window_keyframes = 3;
  StereoOdometry odometry = this->odometry(options);
  begin(&odometry);
  for (size_t k = 1; k < 6; ++k) {
    odometry.track(window_.frames[k], turn(k), true);
    EXPECT_EQ(odometry.keyframes().size(), std::min<size_t>(k + 1, 3));
  }
  EXPECT_LT(error(odometry.keyframes().front().T_WB, truth(3)), 1e-5);
  EXPECT_LT(error(odometry.keyframes().back().T_WB, truth(5)), 1e-5);
}

TEST_F(StereoOdometryState, WithoutBundleAdjustmentItForgetsWhatTheWindowNoLongerSees) {
  StereoOdometryOptions options;
  options.window_keyframes = 2;
  options.ba_rounds = 0;
  StereoOdometry odometry = this->odometry(options);
  begin(&odometry);
  const LandmarkId first = window_.frames[0].observations.front().id;
  ASSERT_EQ(odometry.landmarks().count(first), 1U);
  for (size_t k = 1; k < 4; ++k) {
    TrackedFrame frame = window_.frames[k];
    frame.observations.erase(frame.observations.begin());
    odometry.track(frame, turn(k), true);
  }
  EXPECT_EQ(odometry.landmarks().count(first), 0U);
}

TEST_F(StereoOdometryState, BelievesTheLastVelocityForAWhileOnly) {
  StereoOdometry odometry = inMotion(0.3);
  const TimeNs t = window_.frames[1].t;
  const Vector3d v = velocityTo(1);
  const auto moved = [&](double s) {
    return Vector3d(odometry.predict(t + durationNs(s), Matrix3d::Identity()).t - truth(1).t);
  };
  EXPECT_LT((moved(0.1) - 0.1 * v).norm(), 1e-4);
  EXPECT_LT((moved(0.3) - 0.3 * v).norm(), 1e-4);
  EXPECT_LT((moved(60.0) - 0.3 * v).norm(), 1e-4);
}

TEST_F(StereoOdometryState, UnderCoveredLensesTheVelocityIsBelievedNoLonger) {
  StereoOdometry odometry = inMotion(0.3);
  const TimeNs t = window_.frames[1].t;
  const Vector3d v = velocityTo(1);
  for (int k = 1; k <= 1200; ++k) {  // a minute
    TrackedFrame covered;
    covered.t = t + durationNs(0.05 * k);
    const auto result = odometry.track(covered, Matrix3d::Identity(), false);
    EXPECT_FALSE(result.located);
    const Vector3d moved = result.T_VB.t - truth(1).t;
    ASSERT_LT((moved - std::min(0.05 * k, 0.3) * v).norm(), 1e-4) << k;
  }
  EXPECT_LT(
      (odometry.predict(t + durationNs(61.0), Matrix3d::Identity()).t - odometry.pose().t).norm(),
      1e-12);
}

TEST_F(StereoOdometryState, TheVelocityIsFromFrameToFrameThatWasLocated) {
  StereoOdometry odometry = this->odometry();
  odometry.begin(window_.frames[0], truth(0), Vector3d(5.0, 0.0, 0.0));  // far from the truth
  TrackedFrame covered;
  covered.t = window_.frames[1].t;
  EXPECT_FALSE(odometry.track(covered, turn(1), false).located);
  ASSERT_TRUE(odometry.track(window_.frames[2], turn(2), false).located);
  const TimeNs t = window_.frames[2].t;
  const Vector3d v = velocityTo(2);
  const SE3 ahead = odometry.predict(t + durationNs(0.1), Matrix3d::Identity());
  EXPECT_LT((ahead.t - truth(2).t - 0.1 * v).norm(), 1e-4);
}

TEST_F(StereoOdometryState, BeforeTheFirstFrameItIsAtTheOrigin) {
  StereoOdometry odometry = this->odometry();
  EXPECT_EQ(odometry.predict(7, turn(1)).R, Matrix3d::Identity());
  const auto result = odometry.track(window_.frames[0], turn(1), true);
  EXPECT_TRUE(result.located);
  EXPECT_EQ(result.T_VB.R, Matrix3d::Identity());
  EXPECT_EQ(result.T_VB.t, Vector3d::Zero());
}

TEST_F(StereoOdometryState, AFrameThatIsNotLocatedStartsTheMapAnew) {
  StereoOdometry odometry = this->odometry();
  begin(&odometry);
  TrackedFrame others = window_.frames[1];
  for (Observation& o : others.observations) o.id += 10'000;
  const auto result = odometry.track(others, turn(1), false);
  EXPECT_FALSE(result.located);
  EXPECT_EQ(result.inliers, 0);
  EXPECT_GT(odometry.landmarks().count(others.observations[0].id), 0U);
  // The next frame is located among them: relative to the predicted pose without an error.
  TrackedFrame next = window_.frames[2];
  for (Observation& o : next.observations) o.id += 10'000;
  const auto located = odometry.track(next, turn(2), false);
  EXPECT_TRUE(located.located);
  EXPECT_LT(error(result.T_VB.inverse() * located.T_VB, truth(1).inverse() * truth(2)), 1e-5);
}

TEST_F(StereoOdometryState, LocatedIsWhatEnoughMeasurementsAgreeOn) {
  // Each landmark is two measurements; six landmarks are the twelve that are wanted.
  for (const size_t count : {6, 5}) {
    StereoOdometry odometry = this->odometry();
    begin(&odometry);
    TrackedFrame few = window_.frames[1];
    std::vector<Observation> stereo;
    for (const Observation& o : few.observations)
      if (o.has_right && odometry.landmarks().count(o.id) && stereo.size() < count)
        stereo.push_back(o);
    few.observations = stereo;
    ASSERT_EQ(stereo.size(), count);
    const auto result = odometry.track(few, turn(1), false);
    EXPECT_EQ(result.inliers, 2 * static_cast<int>(count));
    EXPECT_EQ(result.located, count == 6);
  }
}

TEST_F(StereoOdometryState, BeginsWithTheLandmarksThatAreKnown) {
  const LandmarkId known = window_.frames[0].observations[0].id;
  const Vector3d p = window_.landmarks[known] + Vector3d(0.0, 0.0, 1e-3);
  StereoOdometry odometry = this->odometry();
  odometry.begin(window_.frames[0], truth(0), Vector3d::Zero(), {{known, p}});
  EXPECT_EQ(odometry.landmarks().at(known), p);
  EXPECT_GT(odometry.landmarks().size(), 50U);  // the others are triangulated
}

TEST_F(StereoOdometryState, ItsKeyframesAreThoseOfTheWindow) {
  StereoOdometry odometry = this->odometry();
  begin(&odometry);
  odometry.track(window_.frames[1], turn(1), false);
  odometry.track(window_.frames[2], turn(2), true);
  const Trajectory keyframes = odometry.keyframes();
  ASSERT_EQ(keyframes.size(), 2U);
  for (const size_t k : {0U, 1U}) {
    EXPECT_EQ(keyframes[k].t, window_.frames[2 * k].t);
    EXPECT_LT(error(keyframes[k].T_WB, truth(2 * k)), 1e-5);
  }
}

TEST_F(StereoOdometryState, RoundsOfBundleAdjustmentMakeNoisyTracksBetter) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.sigma_px = 0.5;
  window_ = testing::makeSyntheticWindow(options);
  const auto errorWith = [&](int rounds) {
    StereoOdometryOptions with;
    with.sigma_px = 0.5;
    with.ba_rounds = rounds;
    StereoOdometry odometry = this->odometry(with);
    double sum = 0.0;
    for (size_t k = 0; k < window_.truth.size(); ++k) {
      const auto result =
          odometry.track(*window_.keyframes()[k], k ? turn(k) : Matrix3d::Identity(), true);
      sum += (result.T_VB.t - (truth(0).inverse() * truth(k)).t).squaredNorm();
    }
    return std::sqrt(sum);
  };
  EXPECT_LT(errorWith(1), 0.8 * errorWith(0));
}

}  // namespace
}  // namespace etalon
