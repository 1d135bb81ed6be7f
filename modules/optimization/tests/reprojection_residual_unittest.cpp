#include "etalon/optimization/residuals/reprojection_residual.h"

#include <gtest/gtest.h>

#include <random>

#include "etalon/core/so3.h"
#include "etalon/testing/expect_jacobian.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Case {
  SE3 T_WB;
  Vector3d p_W;
};

/** Poses at identity, near pi and in general; landmarks near, far, at the edge of the image. */
std::vector<Case> cases(const SE3& T_BC) {
  std::vector<Case> result;
  for (const Vector3d& phi : {Vector3d(0, 0, 0), Vector3d(1e-9, 0, 0), Vector3d(0.3, -0.7, 1.1),
                              Vector3d(0, M_PI - 1e-6, 0)})
    for (const Vector3d& p_C : {Vector3d(0.1, 0.05, 0.4), Vector3d(-0.7, 0.4, 1.0),
                                Vector3d(0.02, -0.03, 0.05), Vector3d(20, -10, 60)}) {
      Case c;
      c.T_WB = SE3(expSO3(phi), Vector3d(1.0, -2.0, 0.5));
      c.p_W = c.T_WB * (T_BC * p_C);
      result.push_back(c);
    }
  return result;
}

TEST(ReprojectionResidual, JacobiansMatchNumericalOnes) {
  const StereoInertialCalibration calibration = testing::eurocCalibration();
  for (const CameraCalibration& camera : calibration.cameras) {
    const SE3 T_CB = camera.T_BC.inverse();
    for (const Case& c : cases(camera.T_BC)) {
      const auto pixel = camera.model.project(T_CB * (c.T_WB.inverse() * c.p_W));
      ASSERT_TRUE(pixel);
      const auto m = makeMeasurement(camera.model, *pixel + Vector2d(1.5, -0.7), 0.5);
      ASSERT_TRUE(m);
      Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose;
      Eigen::Matrix<double, 2, 3> J_landmark;
      ASSERT_TRUE(reprojectionResidual(T_CB, *m, c.T_WB, c.p_W, &r, &J_pose, &J_landmark));
      const auto residual = [&](const SE3& T_WB, const Vector3d& p_W) {
        Vector2d value;
        EXPECT_TRUE(reprojectionResidual(T_CB, *m, T_WB, p_W, &value));
        return value;
      };
      // From 5 cm to 60 m: at 1e-3 of the least depth truncation is below the rounding of 1e3 px.
      const testing::DifferenceOptions differences{5e-5, 1e-8};
      testing::expectJacobian(
          J_pose, [&](const SE3& T_WB) { return residual(T_WB, c.p_W); }, c.T_WB, differences);
      testing::expectJacobian(
          J_landmark, [&](const Vector3d& p_W) { return residual(c.T_WB, p_W); }, c.p_W,
          differences);
    }
  }
}

TEST(ReprojectionResidual, IsThePixelDistanceToFirstOrder) {
  const CameraCalibration camera = testing::eurocCalibration().cameras[0];
  const SE3 T_CB = camera.T_BC.inverse();
  // At the corner of the image, where the distortion is strongest.
  const Vector3d p_C = Vector3d(-0.70, -0.42, 1.0) * 3.0;
  const Vector3d p_B = camera.T_BC * p_C;
  const Vector2d exact = *camera.model.project(p_C);
  for (const Vector2d& offset : {Vector2d(1, 0), Vector2d(0, 1), Vector2d(-2, 3)}) {
    const auto m = makeMeasurement(camera.model, exact + offset, 2.0);
    ASSERT_TRUE(m);
    Vector2d r;
    ASSERT_TRUE(reprojectionResidual(T_CB, *m, SE3(), p_B, &r));
    EXPECT_LT((r - (-offset / 2.0)).norm(), 0.01 * offset.norm());  // 1 %, as the header says
  }
}

TEST(ReprojectionResidual, RefusesALandmarkBehindTheCamera) {
  const CameraCalibration camera = testing::eurocCalibration().cameras[0];
  const auto m = makeMeasurement(camera.model, Vector2d(300, 200), 1.0);
  Vector2d r(7, 7);
  EXPECT_FALSE(reprojectionResidual(camera.T_BC.inverse(), *m, SE3(),
                                    camera.T_BC * Vector3d(0.1, 0.1, -1.0), &r));
  EXPECT_EQ(r, Vector2d(7, 7));
}

}  // namespace
}  // namespace etalon
