#include "residuals/reprojection_cost.h"

#include <gtest/gtest.h>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::expectJacobians;
using testing::kAttitudes;
using testing::kPosition;
using testing::pointers;
using testing::poseValue;
using testing::Values;

TEST(ReprojectionCost, JacobiansAgreeWithDifferences) {
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  for (const CameraCalibration& camera : calibration.cameras)
    for (const Vector3d& attitude : kAttitudes)
      for (const double inverse_depth : {0.5, 1e-3, 0.0}) {
        const SE3 T_WB(expSO3(attitude), kPosition), T_CB = camera.T_BC.inverse();
        const Vector3d p_C(-0.5, 0.4, 2.0), p_W = T_WB * (camera.T_BC * p_C);
        const auto pixel = camera.model.project(p_C);
        ASSERT_TRUE(pixel);
        const auto m = makeMeasurement(camera.model, *pixel + Eigen::Vector2d(1.5, -0.7), 0.5);
        ASSERT_TRUE(m);
        // The origin is not the camera, and the bearing not quite the axis.
        InverseDepthLandmark landmark(p_W, kPosition + Vector3d(0.02, -0.03, 0.01));
        landmark.parameters = {0.01, -0.02, inverse_depth};
        const char free = 0, held = 1;
        expectJacobians(ReprojectionCost(T_CB, *m, landmark, free),
                        {poseValue(T_WB), landmark.parameters});
        // Held: the same, but for the inverse depth, which nothing moves.
        const ReprojectionCost cost(T_CB, *m, landmark, held);
        Vector2d r;
        Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J;
        double* jacobians[] = {nullptr, J.data()};
        const Values values = {poseValue(T_WB), landmark.parameters};
        ASSERT_TRUE(cost.Evaluate(pointers(values).data(), r.data(), jacobians));
        EXPECT_GT(J.leftCols<2>().norm(), 100.0);
        EXPECT_EQ(J.col(2).norm(), 0.0);
      }
}

TEST(ReprojectionCost, ALandmarkBehindTheCameraIsAnOutlierThatNothingMoves) {
  const CameraCalibration camera = testing::eurocCalibration().cameras[0];
  const SE3 T_WB, T_CB = camera.T_BC.inverse();
  const auto m = makeMeasurement(camera.model, {300, 200}, 0.5);
  ASSERT_TRUE(m);
  const InverseDepthLandmark behind(camera.T_BC * Vector3d(0.1, 0.2, -3.0), camera.T_BC.t);
  const char free = 0;
  const ReprojectionCost cost(T_CB, *m, behind, free);
  Vector2d r;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_landmark;
  double* jacobians[] = {J_pose.data(), J_landmark.data()};
  const Values values = {poseValue(T_WB), behind.parameters};
  ASSERT_TRUE(cost.Evaluate(pointers(values).data(), r.data(), jacobians));
  EXPECT_EQ(r.norm(), kGrossOutlier);
  EXPECT_EQ(J_pose.norm() + J_landmark.norm(), 0.0);
}

}  // namespace
}  // namespace etalon
