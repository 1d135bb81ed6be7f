#include "etalon/core/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace etalon {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

CameraModel pinhole(const std::vector<double>& intrinsics, const std::vector<double>& d) {
  return CameraModel("pinhole", "radial-tangential", 752, 480, intrinsics, d);
}

/** EuRoC's left and right cameras. */
std::vector<CameraModel> eurocCameras() {
  return {pinhole({458.654, 457.296, 367.215, 248.375},
                  {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
          pinhole({457.587, 456.134, 379.999, 255.238},
                  {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05})};
}

/** A camera with strong decentring, so that its terms show. */
CameraModel decentred() { return eurocCameras()[0].with("p1", 0.02).with("p2", -0.03); }

CameraModel withRadial(double k1, double k2) {
  return pinhole(eurocCameras()[0].intrinsics(), {k1, k2, 0.0, 0.0});
}

/** With k3; decentring as well. */
CameraModel withK3() { return withThirdRadial(decentred()).with("k3", -0.03); }

TEST(PinholeRadtan, K3AddsTheSixthPowerOfTheRadius) {
  const CameraModel camera = withK3(), without = camera.with("k3", 0.0);
  const Vector3d ray(0.4, -0.3, 1.0);  // at r = 0.5
  const Vector2d shift = *camera.project(ray) - *without.project(ray);
  const double radial = -0.03 * std::pow(0.5, 6);
  EXPECT_NEAR(shift.x(), camera.focal().x() * 0.4 * radial, 1e-12);
  EXPECT_NEAR(shift.y(), camera.focal().y() * -0.3 * radial, 1e-12);
  EXPECT_EQ(*without.project(ray), *decentred().project(ray));
}

TEST(PinholeRadtan, ProjectsByTheEquations) {
  const CameraModel camera = decentred();
  const auto p = [&camera](const char* name) { return camera.parameter(name); };
  const Vector3d p_C(0.8, -0.6, 2.0);
  const double x = 0.4, y = -0.3, r2 = 0.25;
  const double d = 1 + p("k1") * r2 + p("k2") * r2 * r2;
  const double du = 2 * p("p1") * x * y + p("p2") * (r2 + 2 * x * x);
  const double dv = p("p1") * (r2 + 2 * y * y) + 2 * p("p2") * x * y;
  const double u = p("fu") * (x * d + du) + p("cu");
  const double v = p("fv") * (y * d + dv) + p("cv");
  const auto pixel = camera.project(p_C);
  ASSERT_TRUE(pixel.has_value());
  EXPECT_NEAR(pixel->x(), u, 1e-12);
  EXPECT_NEAR(pixel->y(), v, 1e-12);
  EXPECT_EQ(*camera.project({0, 0, 3}), Vector2d(p("cu"), p("cv")));
  EXPECT_EQ(camera.principalPoint(), Vector2d(p("cu"), p("cv")));
  EXPECT_EQ(camera.focal(), Vector2d(p("fu"), p("fv")));
}

TEST(PinholeRadtan, JacobiansAgreeWithNumericalOnes) {
  constexpr double kStep = 1e-5;
  std::vector<CameraModel> cameras = eurocCameras();
  cameras.push_back(decentred());
  cameras.push_back(withK3());
  for (const CameraModel& camera : cameras) {
    for (const Vector3d& p_C : {Vector3d(0, 0, 1), Vector3d(0.4, -0.3, 1), Vector3d(-2.4, 1.3, 3),
                                Vector3d(0.05, 0.08, 0.1), Vector3d(-30, -18, 40)}) {
      Eigen::Matrix<double, 2, 3> J, numerical;
      ASSERT_TRUE(camera.project(p_C, &J).has_value());
      const double h = kStep * p_C.norm();
      for (int i = 0; i < 3; ++i) {
        const Vector3d d = h * Vector3d::Unit(i);
        numerical.col(i) = (*camera.project(p_C + d) - *camera.project(p_C - d)) / (2 * h);
      }
      // Central differences: truncation 1e-10 relative, rounding 1e-13 px / h.
      EXPECT_LT((J - numerical).norm(), 1e-8 * J.norm()) << p_C.transpose();

      // Of the direction in its plane: moved along that plane's axes.
      Matrix2d D, D_numerical;
      const auto direction = camera.directionOf(p_C, &D);
      ASSERT_TRUE(direction.has_value());
      for (int i = 0; i < 2; ++i) {
        const Vector3d d = kStep * direction->R_MC.row(i).transpose();
        D_numerical.col(i) =
            (*camera.project(direction->ray() + d) - *camera.project(direction->ray() - d)) /
            (2 * kStep);
      }
      EXPECT_LT((D - D_numerical).norm(), 1e-8 * D.norm());
    }
  }
}

TEST(PinholeRadtan, UndistortsTheWholeImage) {
  for (const CameraModel& camera : eurocCameras()) {
    double worst = 0.0;
    for (int v = 0; v < camera.height(); v += 3) {
      for (int u = 0; u < camera.width(); u += 3) {
        const Vector2d pixel(u, v);
        const auto ray = camera.unproject(pixel);
        ASSERT_TRUE(ray.has_value()) << u << ", " << v;
        const auto back = camera.project(*ray);
        ASSERT_TRUE(back.has_value()) << u << ", " << v;
        worst = std::max(worst, (*back - pixel).norm());
      }
    }
    EXPECT_LT(worst, 1e-9);  // 1e-12 in normalised coordinates times the focal length
  }
}

TEST(PinholeRadtan, RefusesPointsItCannotSee) {
  const CameraModel camera = eurocCameras()[0];
  EXPECT_FALSE(camera.project({0.1, 0.1, -1}).has_value());
  EXPECT_FALSE(camera.project({0.1, 0.1, 0}).has_value());
  EXPECT_FALSE(camera.project({0, 0, std::nan("")}).has_value());
}

TEST(PinholeRadtan, RefusesWhatLiesBeyondTheFoldOfTheDistortion) {
  // k2 = 0: r (1 - 0.3 r^2) rises up to r = 1.054; at r = 1.83 the image returns to the centre, and
  // beyond it the derivative's determinant is positive again.
  const CameraModel barrel = withRadial(-0.3, 0.0);
  // r (1 - 0.5 r^2 + 0.06 r^4) rises up to 0.89, falls, and rises anew from 2.05.
  const CameraModel wavy = withRadial(-0.5, 0.06);
  for (double r : {0.1, 0.5, 0.85}) {
    EXPECT_TRUE(barrel.project({r, 0, 1}).has_value()) << r;
    EXPECT_TRUE(wavy.project({0, r, 1}).has_value()) << r;
  }
  for (double r : {1.1, 1.5, 1.82, 1.84, 2.0, 2.1, 3.0, 10.0, 1000.0}) {
    EXPECT_FALSE(barrel.project({0.6 * r, 0.8 * r, 1}).has_value()) << r;
    EXPECT_FALSE(wavy.project({0.6 * r, 0.8 * r, 1}).has_value()) << r;
  }
}

TEST(PinholeRadtan, K3FoldsTheImageToo) {
  // r (1 - 0.2 r^6) rises up to r = 0.945.
  const CameraModel camera("pinhole", "radial-tangential-k3", 752, 480,
                           eurocCameras()[0].intrinsics(), {0.0, 0.0, 0.0, 0.0, -0.2});
  EXPECT_TRUE(camera.project({0.94, 0, 1}).has_value());
  for (double r : {0.95, 1.5, 3.0, 1000.0})
    EXPECT_FALSE(camera.project({0, r, 1}).has_value()) << r;
}

TEST(PinholeRadtan, UndistortsOnlyWhatTheLensCanShow) {
  const CameraModel barrel = withRadial(-0.3, 0.0);
  // The image ends at r' = 1.054 (1 - 0.3 1.054^2) = 0.703.
  const auto pixelAt = [&](double r) {
    return Vector2d(barrel.principalPoint() + barrel.focal().x() * r * Vector2d::UnitX());
  };
  const auto inside = barrel.unproject(pixelAt(0.69));
  ASSERT_TRUE(inside.has_value());
  EXPECT_LT(inside->head<2>().norm(), 1.054);
  EXPECT_LT((barrel.project(*inside).value() - pixelAt(0.69)).norm(), 1e-9);
  for (double r : {0.71, 0.9, 2.0, 10.0, 1000.0})
    EXPECT_FALSE(barrel.unproject(pixelAt(r)).has_value()) << r;
  EXPECT_FALSE(barrel.unproject({std::nan(""), 0.0}).has_value());
}

TEST(PinholeRadtan, KnowsTheImage) {
  const CameraModel camera = eurocCameras()[0];
  EXPECT_TRUE(camera.inImage({0, 0}));
  EXPECT_TRUE(camera.inImage({751, 479}));
  EXPECT_FALSE(camera.inImage({751.1, 479}));
  EXPECT_FALSE(camera.inImage({10, -0.1}));
  EXPECT_FALSE(camera.inImage({9.9, 100}, 10.0));
  EXPECT_TRUE(camera.inImage({10, 100}, 10.0));
  EXPECT_FALSE(camera.inImage({std::nan(""), 100}));
}

}  // namespace
}  // namespace etalon
