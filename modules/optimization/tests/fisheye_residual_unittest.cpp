// The reprojection residual of a camera that sees beside and behind itself.

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/reprojection_residual.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CameraModel fisheye() {
  return CameraModel("pinhole", "equidistant", 512, 512, {191.0, 190.9, 254.9, 256.9},
                     {0.0035, 0.0007, -0.0021, 0.0002});
}

const SE3 kT_CB(expSO3({0.4, -1.0, 0.2}), {0.05, -0.02, 0.01});
const SE3 kT_WB(expSO3({0.3, -0.7, 1.1}), {1.0, -2.0, 0.5});

/** Landmarks at 0, 60, 90 and 100 degrees to the optical axis. */
std::vector<Vector3d> pointsInC() {
  std::vector<Vector3d> points;
  for (double degrees : {0.0, 60.0, 90.0, 100.0}) {
    const double theta = degrees * M_PI / 180.0;
    points.emplace_back(4.0 *
                        Vector3d(0.8 * std::sin(theta), -0.6 * std::sin(theta), std::cos(theta)));
  }
  return points;
}

TEST(FisheyeResidual, IsThePixelDistanceToFirstOrder) {
  for (const Vector3d& p_C : pointsInC()) {
    const Vector2d exact = fisheye().project(p_C).value();
    for (const Vector2d& offset : {Vector2d(1, 0), Vector2d(0, 1), Vector2d(-2, 3)}) {
      const auto m = makeMeasurement(fisheye(), exact + offset, 2.0);
      ASSERT_TRUE(m);
      Vector2d r;
      ASSERT_TRUE(reprojectionResidual(kT_CB, *m, kT_WB, kT_WB * (kT_CB.inverse() * p_C), &r));
      // The residual has the pixel's length, in the axes of its own plane, turned into the image's
      // by S; second order: 3 px of 191 a radian are 1.6 % of a radian.
      EXPECT_LT((r + offset / 2.0).norm(), 0.02 * offset.norm()) << p_C.transpose();
    }
  }
}

TEST(FisheyeResidual, JacobiansMatchNumericalOnesBesideAndBehindTheCamera) {
  constexpr double kStep = 1e-6;
  for (const Vector3d& p_C : pointsInC())
    for (const double inverse_depth : {0.25, 0.0}) {
      const auto m = makeMeasurement(fisheye(), *fisheye().project(p_C) + Vector2d(1.5, -0.7), 0.5);
      ASSERT_TRUE(m);
      InverseDepthLandmark landmark(kT_WB * (kT_CB.inverse() * p_C), kT_WB.t);
      landmark.parameters = {0.01, -0.02, inverse_depth};
      const auto residual = [&](const SE3& T, const InverseDepthLandmark& l) {
        Vector2d r;
        EXPECT_TRUE(reprojectionResidual(kT_CB, *m, T, l, &r));
        return r;
      };
      Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose, N_pose;
      Eigen::Matrix<double, 2, 3> J_landmark, N_landmark;
      ASSERT_TRUE(reprojectionResidual(kT_CB, *m, kT_WB, landmark, &r, &J_pose, &J_landmark));
      for (int i = 0; i < 3; ++i) {
        const Vector3d d = kStep * Vector3d::Unit(i);
        const auto turned = [&](const Vector3d& by) { return SE3(kT_WB.R * expSO3(by), kT_WB.t); };
        const auto moved = [&](const Vector3d& by) { return SE3(kT_WB.R, kT_WB.t + by); };
        const auto other = [&](const Vector3d& by) {
          InverseDepthLandmark l = landmark;
          l.parameters += by;
          return l;
        };
        N_pose.col(i) = residual(turned(d), landmark) - residual(turned(-d), landmark);
        N_pose.col(3 + i) = residual(moved(d), landmark) - residual(moved(-d), landmark);
        N_landmark.col(i) = residual(kT_WB, other(d)) - residual(kT_WB, other(-d));
      }
      // Residuals of a few sigmas are rounded to 1e-13, which the step makes 1e-7 of.
      EXPECT_LT((J_pose - N_pose / (2 * kStep)).norm(), 1e-6 * J_pose.norm());
      EXPECT_LT((J_landmark - N_landmark / (2 * kStep)).norm(), 1e-6 * J_landmark.norm());
    }
}

TEST(FisheyeResidual, RefusesALandmarkOnTheOtherSide) {
  for (const Vector3d& p_C : pointsInC()) {
    const auto m = makeMeasurement(fisheye(), *fisheye().project(p_C), 1.0);
    Vector2d r(7, 7);
    EXPECT_FALSE(reprojectionResidual(kT_CB, *m, kT_WB, kT_WB * (kT_CB.inverse() * -p_C), &r));
    EXPECT_EQ(r, Vector2d(7, 7));
  }
}

}  // namespace
}  // namespace etalon
