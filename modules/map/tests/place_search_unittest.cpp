// Places are recognised in rendered images of a room, from elsewhere.

#include "etalon/map/place_search.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "etalon/core/so3.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/stereo_renderer.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kPlaceSigmaPx = 1.2;

ProfileOptions flightOptions() {
  ProfileOptions options;
  options.profile = MotionProfile::kAggressive;
  options.seed = 3;
  options.start = 0;
  return options;
}

class PlaceSearchTest : public ::testing::Test {
 protected:
  void show(TimeNs t) {
    left_ = renderer_.render(0, flight_, t);
    right_ = renderer_.render(1, flight_, t);
    views_->show(left_, right_);
  }
  SE3 poseAt(TimeNs t) const { return flight_.at(t).T_WB; }

  /** Corners of the current image, where the room has them. */
  std::vector<SeenLandmark> landmarksAt(TimeNs t) const {
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(left_, corners, 150, 0.01, 12.0);
    const SE3& T_BC = calibration_.cameras[0].T_BC;
    const SE3 T_WC = poseAt(t) * T_BC;
    std::vector<SeenLandmark> landmarks;
    for (const cv::Point2f& corner : corners) {
      const Eigen::Vector2d pixel(corner.x, corner.y);
      const auto ray = calibration_.cameras[0].model.unproject(pixel);
      const auto p_W = ray ? room_.firstHit(T_WC.t, T_WC.R * *ray) : std::optional<Vector3d>();
      if (p_W)
        landmarks.push_back(seenLandmark(T_BC, static_cast<LandmarkId>(landmarks.size()), pixel,
                                         poseAt(t).inverse() * *p_W, 0.02, 0.001));
    }
    return landmarks;
  }

  StereoInertialCalibration calibration_ = eurocCalibration();
  ProfileTrajectory flight_{flightOptions()};
  Room room_ = makeRoom(flight_);
  StereoRenderer renderer_{room_, calibration_};
  std::shared_ptr<ImageViews> views_ = std::make_shared<ImageViews>(calibration_);
  cv::Mat left_, right_;
};

TEST_F(PlaceSearchTest, ABodyThatIsNearAgainKnowsWhereItIs) {
  PlaceSearch places(calibration_, MapOptions(), kPlaceSigmaPx, views_);
  const TimeNs there = durationNs(8.0), here = durationNs(8.4), elsewhere = durationNs(14.0);
  Trajectory keyframes;
  for (const TimeNs t : {there, elsewhere}) {
    show(t);
    ASSERT_TRUE(views_->keep(t));
    keyframes.push_back({t, poseAt(t)});
  }
  places.remember(keyframes);
  views_->dropAllBut({});  // remembered places stay
  show(here);
  const std::vector<SeenLandmark> landmarks = landmarksAt(here);
  EXPECT_FALSE(places.look(landmarks));  // nothing is prepared
  for (int i = 0; i < 3; ++i) places.prepareOne();
  const auto sighting = places.look(landmarks);
  ASSERT_TRUE(sighting);
  EXPECT_EQ(sighting->place, there);
  EXPECT_GE(sighting->observations.size(), 20U);
  const SE3 T_WN = sighting->T_WP * sighting->view.T_NV.inverse();
  EXPECT_GT((poseAt(there).t - poseAt(here).t).norm(), 0.1);
  EXPECT_LT((T_WN.t - poseAt(here).t).norm(), 0.02);
  EXPECT_LT(logSO3(T_WN.R.transpose() * poseAt(here).R).norm(), 0.01);

  // Known to 20 cm and a degree, without the features.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.diagonal() << Vector3d::Constant(3e-4), Vector3d::Constant(0.04);
  const SE3 guess(poseAt(here).R * expSO3({0.01, -0.01, 0.01}),
                  poseAt(here).t + Vector3d(0.1, -0.1, 0.05));
  const auto again = places.lookNear(guess, covariance, landmarks);
  ASSERT_TRUE(again);
  EXPECT_LT(((again->T_WP * again->view.T_NV.inverse()).t - poseAt(here).t).norm(), 0.02);
}

TEST_F(PlaceSearchTest, APlaceThatItHasNeverSeenIsNone) {
  PlaceSearch places(calibration_, MapOptions(), kPlaceSigmaPx, views_);
  const StereoRenderer other(room_, calibration_, [] {
    RenderOptions options;
    options.seed = 2;  // other textures in the same room
    return options;
  }());
  const TimeNs there = durationNs(8.0);
  const cv::Mat left = other.render(0, flight_, there), right = other.render(1, flight_, there);
  views_->show(left, right);
  ASSERT_TRUE(views_->keep(there));
  places.remember({{there, poseAt(there)}});
  places.prepareOne();
  show(there);
  EXPECT_FALSE(places.look(landmarksAt(there)));
}

TEST_F(PlaceSearchTest, AsManyPlacesAreRememberedAsTheMapMayHave) {
  MapOptions options;
  options.max_keyframes = 3;
  PlaceSearch places(calibration_, options, kPlaceSigmaPx, views_);
  Trajectory keyframes;
  for (int i = 0; i < 5; ++i) {
    const TimeNs t = durationNs(4.0 + 2.0 * i);
    show(t);
    views_->keep(t);
    keyframes.push_back({t, poseAt(t)});
  }
  places.remember(keyframes);
  views_->dropAllBut({});
  int kept = 0;
  for (const StampedPose& keyframe : keyframes) kept += views_->has(keyframe.t);
  EXPECT_EQ(kept, 3);
}

}  // namespace
}  // namespace etalon
