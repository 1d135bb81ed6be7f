// What the tracker does with images that are wrong, dark, or show what it must not believe.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/frontend/stereo_tracker.h"
#include "textured_wall.h"

namespace etalon {
namespace {

constexpr TimeNs kFrame = 50'000'000;  // 20 Hz

TEST(StereoTrackerInput, RefusesImagesOfAnotherSizeOrType) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const auto [left, right] = wall.pair(SE3());
  cv::Mat colour, wide, deep;
  cv::cvtColor(left, colour, cv::COLOR_GRAY2BGR);
  cv::resize(left, wide, {left.cols + 1, left.rows});
  left.convertTo(deep, CV_16U);
  StereoTracker tracker(rig, StereoTrackerOptions{});
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  tracker.track(0, left, right, I);
  for (const cv::Mat& wrong : {colour, wide, deep, cv::Mat()}) {
    EXPECT_THROW(tracker.track(kFrame, wrong, right, I), DataError);
    EXPECT_THROW(tracker.track(kFrame, left, wrong, I), DataError);
  }
  try {
    tracker.track(kFrame, left, wide, I);
    ADD_FAILURE();
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("camera 1"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("376 x 240"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("377 x 240"));
  }
  // The refused frames left no trace: all landmarks are still followed.
  tracker.track(kFrame, left, right, I);
  EXPECT_GT(tracker.statistics().tracked, 100);
  EXPECT_EQ(tracker.statistics().lost, 0);
}

TEST(StereoTrackerInput, RefusesPatchesWithoutAPixelInTheirMiddle) {
  for (int StereoTrackerOptions::*side :
       {&StereoTrackerOptions::klt_window_px, &StereoTrackerOptions::anchor_window_px}) {
    StereoTrackerOptions options;
    options.*side = 16;
    EXPECT_THROW(StereoTracker(smallRig(), options), ConfigError);
    options.*side = 17;
    EXPECT_NO_THROW(StereoTracker(smallRig(), options));
  }
}

TEST(StereoTrackerInput, TheImageMayBeSmallBesideTheWindowOfKlt) {
  // Half the image would be no larger than the window, so KLT has the full image alone. Matching
  // with the right image does not depend on it.
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const auto [left, right] = wall.pair(SE3());
  StereoInertialCalibration part = rig;
  const cv::Rect middle(120, 80, 120, 80);
  for (CameraCalibration& camera : part.cameras) {
    const CameraModel& m = camera.model;
    camera.model = CameraModel("pinhole", "radial-tangential", middle.width, middle.height,
                               {m.focal().x(), m.focal().y(), m.principalPoint().x() - middle.x,
                                m.principalPoint().y() - middle.y},
                               m.coefficients());
  }
  std::vector<int> with_stereo;
  for (const int window_px : {9, 63}) {
    StereoTrackerOptions options;
    options.klt_window_px = window_px;
    StereoTracker tracker(part, options);
    for (const TimeNs t : {TimeNs{0}, kFrame})
      tracker.track(t, left(middle).clone(), right(middle).clone(), Eigen::Matrix3d::Identity());
    EXPECT_EQ(tracker.statistics().lost, 0);
    with_stereo.push_back(tracker.statistics().with_stereo);
  }
  EXPECT_GT(with_stereo[0], 20);
  EXPECT_EQ(with_stereo[1], with_stereo[0]);
}

TEST(StereoTrackerInput, SurvivesBlackImages) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const auto [left, right] = wall.pair(SE3());
  const cv::Mat black = cv::Mat::zeros(left.size(), CV_8UC1);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  StereoTracker tracker(rig, StereoTrackerOptions{});
  EXPECT_TRUE(tracker.track(0, black, black, I).observations.empty());
  const TrackedFrame before = tracker.track(kFrame, left, right, I);
  ASSERT_GT(before.observations.size(), 100U);
  EXPECT_TRUE(tracker.track(2 * kFrame, black, black, I).observations.empty());
  EXPECT_EQ(tracker.statistics().lost, static_cast<int>(before.observations.size()));
  // The very same images again: nothing is known of them any more, and ids are new.
  const TrackedFrame after = tracker.track(3 * kFrame, left, right, I);
  EXPECT_EQ(after.observations.size(), before.observations.size());
  EXPECT_GT(after.observations.front().id, before.observations.back().id);
  // One dark camera: the landmarks live on without a right pixel.
  tracker.track(4 * kFrame, left, black, I);
  EXPECT_EQ(tracker.statistics().with_stereo, 0);
  EXPECT_GT(tracker.statistics().tracked, 100);
  tracker.track(5 * kFrame, left, right, I);
  EXPECT_GT(tracker.statistics().with_stereo, 80);
}

TEST(StereoTrackerInput, DropsWhatMovesOtherwise) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 3.0), other(rig, 3.0, 1.0, 2);
  // The camera moves to the right; an eighth of the image shows another wall that moves up by 8 px.
  const SE3 T_WB(Eigen::Matrix3d::Identity(), {0.15, 0.0, 0.0});
  const cv::Rect window(20, 60, 100, 100);
  std::array<std::pair<cv::Mat, cv::Mat>, 2> pairs = {wall.pair(SE3()), wall.pair(T_WB)};
  for (int i = 0; i < 2; ++i) {
    const SE3 T_WO(Eigen::Matrix3d::Identity(), {0.0, i * 8.0 * 3.0 / 228.6, 0.0});
    other.image(0, T_WO)(window).copyTo(pairs[i].first(window));
  }
  StereoTracker tracker(rig, StereoTrackerOptions{});
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const TrackedFrame before = tracker.track(0, pairs[0].first, pairs[0].second, I);
  const TrackedFrame after = tracker.track(kFrame, pairs[1].first, pairs[1].second, I);
  std::set<LandmarkId> inside, all;
  for (const Observation& o : before.observations) {
    all.insert(o.id);
    // Away from the window's edge, where patches see both.
    if (cv::Rect(30, 80, 80, 70).contains(cv::Point(cvRound(o.left.x()), cvRound(o.left.y()))))
      inside.insert(o.id);
  }
  ASSERT_GT(inside.size(), 8U);
  size_t inside_after = 0, all_after = 0;
  for (const Observation& o : after.observations) {
    inside_after += inside.count(o.id);
    all_after += all.count(o.id);
  }
  EXPECT_LE(inside_after, 1U);
  EXPECT_GT(all_after, 100U);
}

TEST(StereoTrackerInput, RefusesRightPixelsOffTheirEpipolarLine) {
  const StereoInertialCalibration rig = smallRig();
  const TexturedWall wall(rig, 2.0);
  const auto [left, right] = wall.pair(SE3());
  // Epipolar lines are nearly horizontal: a right image 2.5 px lower is 2.5 px off them. The
  // patches are found all the same, within the alignment's reach of 4 px.
  cv::Mat lowered;
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 0, 0, 1, 2.5);
  cv::warpAffine(right, lowered, shift, right.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  const auto withStereo = [&, left = left](const cv::Mat& right_image, double epipolar_px) {
    StereoTrackerOptions options;
    options.epipolar_px = epipolar_px;
    StereoTracker tracker(rig, options);
    tracker.track(0, left, right_image, Eigen::Matrix3d::Identity());
    return tracker.statistics().with_stereo;
  };
  const double px = StereoTrackerOptions().epipolar_px;
  EXPECT_GT(withStereo(right, px), 100);
  EXPECT_LE(withStereo(lowered, px), 2);
  EXPECT_GT(withStereo(lowered, 10.0), 50);  // so it is this check that refuses them
}

}  // namespace
}  // namespace etalon
