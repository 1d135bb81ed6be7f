// Where a view stops showing a landmark, and how far its place may be off.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/map/image_views.h"
#include "etalon/map/view_geometry.h"
#include "etalon/map/view_selection.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/** A landmark in the middle of the left image, 4 m away, and views of it. */
class ViewLimits : public ::testing::Test {
 protected:
  ViewLimits() : left_(rig_.cameras[0]) {
    landmark_.id = 3;
    landmark_.pixel = left_.model.principalPoint();
    landmark_.p_N = left_.T_BC * Vector3d(0.0, 0.0, 4.0);
  }
  /** The pose of a view whose left camera stands at `centre` (m, in the current left camera) and
   * looks at the landmark, turned aside by `aside`. */
  SE3 viewAt(const Vector3d& centre, const Vector3d& aside = Vector3d::Zero()) const {
    const Vector3d z = (Vector3d(0.0, 0.0, 4.0) - centre).normalized();
    const Vector3d x = Vector3d::UnitY().cross(z).normalized();
    Eigen::Matrix3d R;
    R << x, z.cross(x), z;
    return left_.T_BC * SE3(R * expSO3(aside), centre) * left_.T_BC.inverse();
  }
  bool seen(const SE3& T_NV) const { return isInView(rig_, T_NV, landmark_); }

  StereoInertialCalibration rig_ = eurocCalibration();
  const CameraCalibration& left_;
  SeenLandmark landmark_;
};

TEST_F(ViewLimits, TheDirectionMayDifferByThirtyFiveDegrees) {
  const auto around = [](double degrees) {
    const double a = degrees * M_PI / 180.0;
    return Vector3d(4.0 * std::sin(a), 0.0, 4.0 - 4.0 * std::cos(a));
  };
  EXPECT_TRUE(seen(viewAt(around(0.0))));
  EXPECT_TRUE(seen(viewAt(around(34.9))));
  EXPECT_FALSE(seen(viewAt(around(35.1))));
  EXPECT_TRUE(seen(viewAt(around(-34.9))));
  EXPECT_FALSE(seen(viewAt(around(-35.1))));
}

TEST_F(ViewLimits, TheDistanceMayDifferByAFactorOfTwo) {
  EXPECT_TRUE(seen(viewAt({0.0, 0.0, 1.99})));
  EXPECT_FALSE(seen(viewAt({0.0, 0.0, 2.01})));
  EXPECT_TRUE(seen(viewAt({0.0, 0.0, -3.99})));
  EXPECT_FALSE(seen(viewAt({0.0, 0.0, -4.01})));
}

TEST_F(ViewLimits, ThePixelKeepsItsDistanceFromTheEdge) {
  // Turned about the vertical: pixel 12 and one to the left of it.
  const auto pixelOf = [&](double yaw) {
    const SE3 T_NV = viewAt(Vector3d::Zero(), {0.0, yaw, 0.0});
    return left_.model.project((T_NV * left_.T_BC).inverse() * landmark_.p_N)->x();
  };
  double inside = 0.0, outside = 1.2;
  while (outside - inside > 1e-6) {
    const double middle = 0.5 * (inside + outside);
    (seen(viewAt(Vector3d::Zero(), {0.0, middle, 0.0})) ? inside : outside) = middle;
  }
  EXPECT_NEAR(pixelOf(inside), 12.0, 0.01);
}

TEST_F(ViewLimits, TheReachIsThreeSigmaOfPoseLandmarkAndPixelAndTwoPixels) {
  OldView view;
  view.T_NV = viewAt({0.3, 0.0, 0.0});
  const auto reach = [&] { return predictInView(rig_, view, landmark_, 0.5)->reach_px; };
  const double both = std::sqrt(2.0);  // of the two coordinates of a pixel
  EXPECT_NEAR(reach(), 2.0 + 3.0 * both * 0.5, 0.05);
  // A view that may be off by 2 cm across the line of sight, 4 m away: 458 px * 0.02 / 4 = 2.3 px.
  view.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(4e-4);
  EXPECT_NEAR(reach(), 2.0 + 3.0 * both * std::hypot(0.5, 458.0 * 0.02 / 4.0), 0.3);
  // A rotation by 0.01 rad: 4.6 px.
  view.covariance.setZero();
  view.covariance.topLeftCorner<3, 3>().diagonal().setConstant(1e-4);
  EXPECT_NEAR(reach(), 2.0 + 3.0 * both * std::hypot(0.5, 4.58), 0.5);
  // So may the landmark be, in any direction; its distance hardly matters in this view.
  view.covariance.setZero();
  landmark_.covariance = 4e-4 * Eigen::Matrix3d::Identity();
  EXPECT_NEAR(reach(), 2.0 + 3.0 * both * std::hypot(0.5, 458.0 * 0.02 / 4.0), 0.3);
}

TEST_F(ViewLimits, AQueryNamesItsLandmarkAndTheSameViewShowsItWhereItIs) {
  const auto query = predictInView(rig_, OldView(), landmark_, 0.5);
  ASSERT_TRUE(query);
  EXPECT_EQ(query->id, 3);
  EXPECT_EQ(query->pixel, landmark_.pixel);
  EXPECT_LT((query->left - landmark_.pixel).norm(), 1e-6);
  EXPECT_LT((query->A - Eigen::Matrix2d::Identity()).norm(), 1e-6);
  const CameraCalibration& right = rig_.cameras[1];
  EXPECT_TRUE(query->has_right);
  EXPECT_LT((query->right - *right.model.project(right.T_BC.inverse() * landmark_.p_N)).norm(),
            1e-9);
  OldView behind;
  behind.T_NV = viewAt({0.0, 0.0, 2.5});
  EXPECT_FALSE(predictInView(rig_, behind, landmark_, 0.5));
}

TEST(ViewSelectionLimits, DistancesAndAnglesCountAsConfigured) {
  const auto at = [](double x, double yaw) { return SE3(expSO3({0.0, yaw, 0.0}), {x, 0.0, 0.0}); };
  MapOptions options;
  options.spread_m = 1.0;
  options.spread_deg = 10.0;
  // 1 m against 9 deg and 11 deg.
  EXPECT_EQ(redundantView({at(0, 0), at(1, 0), at(50, 0), at(50, 9 * M_PI / 180)}, options), 3U);
  EXPECT_EQ(redundantView({at(0, 0), at(1, 0), at(50, 0), at(50, 11 * M_PI / 180)}, options), 1U);
  options.spread_m = 2.0;
  EXPECT_EQ(redundantView({at(0, 0), at(1, 0), at(50, 0), at(50, 9 * M_PI / 180)}, options), 1U);
  // A roll about the optical axis does not change the viewing direction. Of equally redundant pairs
  // the first one counts.
  EXPECT_EQ(
      redundantView({at(0, 0), at(1, 0), SE3(expSO3({0.0, 0.0, 2.0}), {0.1, 0.0, 0.0})}, options),
      2U);
  EXPECT_EQ(redundantView({at(0, 0), at(1, 0), at(2, 0)}, options), 1U);
}

TEST(ImageViewsLimits, WithoutImagesNothingIsKeptNorFound) {
  ImageViews views{eurocCalibration()};
  EXPECT_FALSE(views.keep(1));  // nothing was shown
  views.show(cv::Mat(), cv::Mat());
  EXPECT_FALSE(views.keep(1));
  cv::Mat image(60, 80, CV_8UC1, cv::Scalar(90));
  views.show(image, image);
  EXPECT_FALSE(views.keep(1));  // it shows nothing
  image.colRange(0, 10).setTo(200);
  views.show(image, image);
  EXPECT_TRUE(views.keep(1));
  ViewQuery query;
  query.pixel = query.left = {40.0, 30.0};
  query.reach_px = 3.0;
  for (const TimeNs view : {1, 2}) {  // without texture there; unknown
    const auto matches = views.find(view, {query, query});
    ASSERT_EQ(matches.size(), 2U);
    EXPECT_FALSE(matches[0].found || matches[1].found);
  }
  EXPECT_TRUE(views.find(1, {}).empty());
}

}  // namespace
}  // namespace etalon
