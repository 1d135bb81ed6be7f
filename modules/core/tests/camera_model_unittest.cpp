#include "etalon/core/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace etalon {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/** EuRoC's left and right cameras. */
std::vector<PinholeRadtan> eurocCameras() {
  PinholeRadtan left;
  left.width = 752;
  left.height = 480;
  left.fu = 458.654;
  left.fv = 457.296;
  left.cu = 367.215;
  left.cv = 248.375;
  left.k1 = -0.28340811;
  left.k2 = 0.07395907;
  left.p1 = 0.00019359;
  left.p2 = 1.76187114e-05;
  PinholeRadtan right = left;
  right.fu = 457.587;
  right.fv = 456.134;
  right.cu = 379.999;
  right.cv = 255.238;
  right.k1 = -0.28368365;
  right.k2 = 0.07451284;
  right.p1 = -0.00010473;
  right.p2 = -3.55590700e-05;
  return {left, right};
}

/** A camera with strong decentring, so that its terms show. */
PinholeRadtan decentred() {
  PinholeRadtan camera = eurocCameras()[0];
  camera.p1 = 0.02;
  camera.p2 = -0.03;
  return camera;
}

PinholeRadtan withRadial(double k1, double k2) {
  PinholeRadtan camera = eurocCameras()[0];
  camera.k1 = k1;
  camera.k2 = k2;
  camera.p1 = camera.p2 = 0.0;
  return camera;
}

TEST(PinholeRadtan, ProjectsByTheEquations) {
  const PinholeRadtan c = decentred();
  const Vector3d p_C(0.8, -0.6, 2.0);
  const double x = 0.4, y = -0.3, r2 = 0.25;
  const double d = 1 + c.k1 * r2 + c.k2 * r2 * r2;
  const double u = c.fu * (x * d + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x)) + c.cu;
  const double v = c.fv * (y * d + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y) + c.cv;
  const auto pixel = c.project(p_C);
  ASSERT_TRUE(pixel.has_value());
  EXPECT_NEAR(pixel->x(), u, 1e-12);
  EXPECT_NEAR(pixel->y(), v, 1e-12);
  EXPECT_EQ(c.normalizedToPixel({x, y}), *pixel);
  EXPECT_EQ(*c.project({0, 0, 3}), Vector2d(c.cu, c.cv));
}

TEST(PinholeRadtan, JacobiansAgreeWithNumericalOnes) {
  constexpr double kStep = 1e-5;
  std::vector<PinholeRadtan> cameras = eurocCameras();
  cameras.push_back(decentred());
  for (const PinholeRadtan& camera : cameras) {
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

      const Vector2d xy = p_C.head<2>() / p_C.z();
      Matrix2d D, D_numerical, P, P_numerical;
      camera.distort(xy, &D);
      camera.normalizedToPixel(xy, &P);
      for (int i = 0; i < 2; ++i) {
        const Vector2d d = kStep * Vector2d::Unit(i);
        D_numerical.col(i) = (camera.distort(xy + d) - camera.distort(xy - d)) / (2 * kStep);
        P_numerical.col(i) =
            (camera.normalizedToPixel(xy + d) - camera.normalizedToPixel(xy - d)) / (2 * kStep);
      }
      EXPECT_LT((D - D_numerical).norm(), 1e-9);
      EXPECT_LT((P - P_numerical).norm(), 1e-8 * P.norm());
    }
  }
}

TEST(PinholeRadtan, UndistortsTheWholeImage) {
  for (const PinholeRadtan& camera : eurocCameras()) {
    double worst = 0.0;
    for (int v = 0; v < camera.height; v += 3) {
      for (int u = 0; u < camera.width; u += 3) {
        const Vector2d pixel(u, v);
        const auto xy = camera.pixelToNormalized(pixel);
        ASSERT_TRUE(xy.has_value()) << u << ", " << v;
        const auto back = camera.project(Vector3d(xy->x(), xy->y(), 1.0));
        ASSERT_TRUE(back.has_value()) << u << ", " << v;
        worst = std::max(worst, (*back - pixel).norm());
      }
    }
    EXPECT_LT(worst, 1e-9);  // 1e-12 in normalised coordinates times the focal length
  }
}

TEST(PinholeRadtan, RefusesPointsItCannotSee) {
  const PinholeRadtan camera = eurocCameras()[0];
  EXPECT_FALSE(camera.project({0.1, 0.1, -1}).has_value());
  EXPECT_FALSE(camera.project({0.1, 0.1, 0}).has_value());
  EXPECT_FALSE(camera.project({0, 0, std::nan("")}).has_value());
}

TEST(PinholeRadtan, RefusesWhatLiesBeyondTheFoldOfTheDistortion) {
  // k2 = 0: r (1 - 0.3 r^2) rises up to r = 1.054; at r = 1.83 the image returns to the centre, and
  // beyond it the derivative's determinant is positive again.
  const PinholeRadtan barrel = withRadial(-0.3, 0.0);
  // r (1 - 0.5 r^2 + 0.06 r^4) rises up to 0.89, falls, and rises anew from 2.05.
  const PinholeRadtan wavy = withRadial(-0.5, 0.06);
  for (double r : {0.1, 0.5, 0.85}) {
    EXPECT_TRUE(barrel.project({r, 0, 1}).has_value()) << r;
    EXPECT_TRUE(wavy.project({0, r, 1}).has_value()) << r;
  }
  for (double r : {1.1, 1.5, 1.82, 1.84, 2.0, 2.1, 3.0, 10.0, 1000.0}) {
    EXPECT_FALSE(barrel.project({0.6 * r, 0.8 * r, 1}).has_value()) << r;
    EXPECT_FALSE(wavy.project({0.6 * r, 0.8 * r, 1}).has_value()) << r;
  }
}

TEST(PinholeRadtan, UndistortsOnlyWhatTheLensCanShow) {
  const PinholeRadtan barrel = withRadial(-0.3, 0.0);
  // The image ends at r' = 1.054 (1 - 0.3 1.054^2) = 0.703.
  const auto pixelAt = [&](double r) { return Vector2d(barrel.cu + barrel.fu * r, barrel.cv); };
  const auto inside = barrel.pixelToNormalized(pixelAt(0.69));
  ASSERT_TRUE(inside.has_value());
  EXPECT_LT(inside->norm(), 1.054);
  EXPECT_LT((barrel.normalizedToPixel(*inside) - pixelAt(0.69)).norm(), 1e-9);
  for (double r : {0.71, 0.9, 2.0, 10.0, 1000.0})
    EXPECT_FALSE(barrel.pixelToNormalized(pixelAt(r)).has_value()) << r;
  EXPECT_FALSE(barrel.pixelToNormalized({std::nan(""), 0.0}).has_value());
}

TEST(PinholeRadtan, KnowsTheImage) {
  const PinholeRadtan camera = eurocCameras()[0];
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
