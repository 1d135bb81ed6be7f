#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "etalon/core/camera_model.h"
#include "etalon/core/errors.h"

namespace etalon {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

CameraModel fisheye(const std::vector<double>& k) {
  return CameraModel("pinhole", "equidistant", 512, 512, {190.98, 190.97, 254.93, 256.9}, k);
}

/** Of the kind of the TUM VI benchmark (195 degrees): theta_d rises up to 180 degrees. */
CameraModel wide() { return fisheye({0.0034824, 0.00071503, -0.0020532, 0.00020294}); }

/** theta_d = theta (1 - 0.1 theta^2) rises up to theta = sqrt(1 / 0.3), 104.6 degrees. */
CameraModel folding() { return fisheye({-0.1, 0.0, 0.0, 0.0}); }

Vector3d rayAt(double theta, double azimuth) {
  return {std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth),
          std::cos(theta)};
}

/** Angles to the optical axis: on it, next to it, beside and behind the camera. */
const std::vector<double> kAngles = {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.3, 1.0, 1.5, 1.5708, 1.7};

TEST(Equidistant, AgreesWithOpenCv) {
  // OpenCV's fisheye projects what lies in front of the camera only.
  const CameraModel camera = wide();
  const auto& f = camera.intrinsics();
  const cv::Matx33d K(f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1);
  const cv::Vec4d D(camera.coefficients().data());
  std::vector<cv::Point3d> points;
  for (double theta : {0.0, 1e-6, 0.01, 0.3, 0.8, 1.2, 1.5})
    for (double azimuth = 0.1; azimuth < 6.2; azimuth += 0.7) {
      const Vector3d p = 2.5 * rayAt(theta, azimuth);
      points.emplace_back(p.x(), p.y(), p.z());
    }
  std::vector<cv::Point2d> pixels;
  cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), K, D);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto pixel = camera.project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel.has_value());
    // OpenCV rounds near the axis, where it takes theta_d / r for 1 below r = 1e-8.
    EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-6);
    EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-6);
  }
}

TEST(Equidistant, JacobiansAgreeWithNumericalOnes) {
  for (const CameraModel& camera : {wide(), folding(), fisheye({0.0, 0.0, 0.0, 0.0})})
    for (double theta : kAngles)
      for (double azimuth : {0.3, 1.9, 4.0})
        for (double distance : {0.05, 40.0}) {
          const Vector3d p_C = distance * rayAt(theta, azimuth);
          Eigen::Matrix<double, 2, 3> J, numerical;
          ASSERT_TRUE(camera.project(p_C, &J).has_value()) << theta;
          const double h = 1e-5 * distance;
          for (int i = 0; i < 3; ++i) {
            const Vector3d d = h * Vector3d::Unit(i);
            numerical.col(i) = (*camera.project(p_C + d) - *camera.project(p_C - d)) / (2 * h);
          }
          // Central differences: truncation 1e-10 relative, rounding 1e-13 px / 1e-5.
          EXPECT_LT((J - numerical).norm(), 1e-7 * J.norm()) << theta << " " << azimuth;
          // Along the ray the pixel stays.
          EXPECT_LT((J * p_C).norm(), 1e-12 * J.norm() * distance);

          Matrix2d D, D_numerical;
          const auto direction = camera.directionOf(p_C, &D);
          ASSERT_TRUE(direction.has_value());
          EXPECT_LT((direction->R_MC * p_C - distance * Vector3d::UnitZ()).norm(),
                    1e-14 * distance);
          EXPECT_NEAR(direction->R_MC.determinant(), 1.0, 1e-14);
          for (int i = 0; i < 2; ++i) {
            const Vector3d d = 1e-5 * direction->R_MC.row(i).transpose();
            D_numerical.col(i) =
                (*camera.project(direction->ray() + d) - *camera.project(direction->ray() - d)) /
                2e-5;
          }
          EXPECT_LT((D - D_numerical).norm(), 1e-7 * D.norm());
        }
}

TEST(Equidistant, UnprojectsWhatItProjects) {
  for (const CameraModel& camera : {wide(), folding()})
    for (double theta : kAngles)
      for (double azimuth = 0.05; azimuth < 6.2; azimuth += 0.5) {
        const Vector3d ray = rayAt(theta, azimuth);
        const auto back = camera.unproject(camera.project(3.0 * ray).value());
        ASSERT_TRUE(back.has_value());
        EXPECT_NEAR(back->norm(), 1.0, 1e-14);
        // Pixels near 500 are rounded to 6e-14, which is 3e-16 rad.
        EXPECT_LT((*back - ray).norm(), 1e-14) << theta << " " << azimuth;
      }
}

TEST(Equidistant, UnprojectsTheWholeImage) {
  const CameraModel camera = wide();
  for (int v = 0; v < camera.height(); v += 7)
    for (int u = 0; u < camera.width(); u += 7) {
      const auto ray = camera.unproject(Vector2d(u, v));
      ASSERT_TRUE(ray.has_value()) << u << ", " << v;
      EXPECT_LT((camera.project(*ray).value() - Vector2d(u, v)).norm(), 1e-11);
    }
  EXPECT_LT(camera.unproject({0, 0})->z(), -0.2);  // the corner looks backwards
}

TEST(Equidistant, EndsWhereTheDistortionTurns) {
  const double edge = std::sqrt(1.0 / 0.3);
  const CameraModel camera = folding();
  EXPECT_TRUE(camera.project(rayAt(edge - 1e-6, 0.4)).has_value());
  for (double theta : {edge + 1e-6, 1.9, 2.5, 3.1})
    EXPECT_FALSE(camera.project(rayAt(theta, 0.4)).has_value()) << theta;
  const double radius = camera.focal().x() * edge * (1.0 - 0.1 * edge * edge);
  const auto pixelAt = [&](double r) {
    return Vector2d(camera.principalPoint() + r * Vector2d::UnitX());
  };
  const auto last = camera.unproject(pixelAt(radius - 1e-6));
  ASSERT_TRUE(last.has_value());
  // Where theta_d is flat a pixel says little: 1e-6 px are 1e-4 rad.
  EXPECT_NEAR(std::acos(last->z()), edge, 1e-3);
  EXPECT_FALSE(camera.unproject(pixelAt(radius + 1e-6)).has_value());
  EXPECT_FALSE(camera.unproject({std::nan(""), 0.0}).has_value());
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.0}).has_value());
  EXPECT_FALSE(camera.project({0.0, 0.0, std::nan("")}).has_value());
}

TEST(Equidistant, ReachesToRightBehindTheCamera) {
  const CameraModel camera = wide();
  EXPECT_TRUE(camera.project(rayAt(179.0 * kDegree, 0.4)).has_value());
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}).has_value());  // in all directions at once
  EXPECT_FALSE(camera.isPerspective());
  EXPECT_EQ(camera.rangeOf({3.0, 0.0, -4.0}), 5.0);
}

TEST(CameraModel, IsAValue) {
  const CameraModel a = wide(), b = wide();
  EXPECT_TRUE(a == b);
  EXPECT_TRUE(a != a.with("k3", 0.0));
  EXPECT_EQ(a.with("cu", 200.0).principalPoint().x(), 200.0);
  EXPECT_EQ(a.with("k4", 0.5).parameter("k4"), 0.5);
  EXPECT_THROW(a.parameter("p1"), ConfigError);
  const CameraModel none;
  EXPECT_TRUE(none != a && none == CameraModel());
  EXPECT_FALSE(none.project({0, 0, 1}).has_value());
  EXPECT_FALSE(none.unproject({0, 0}).has_value());
}

TEST(CameraModel, RefusesWhatIsNoCamera) {
  const std::vector<double> f = {100, 100, 50, 50}, none;
  EXPECT_NO_THROW(CameraModel("pinhole", "none", 100, 100, f, none));
  EXPECT_THROW(CameraModel("omni", "radtan", 100, 100, f, {0, 0, 0, 0}), ConfigError);
  EXPECT_THROW(CameraModel("pinhole", "radtan", 100, 100, f, none), ConfigError);
  EXPECT_THROW(CameraModel("pinhole", "none", 0, 100, f, none), ConfigError);
  EXPECT_THROW(CameraModel("pinhole", "none", 100, 100, {100, -100, 50, 50}, none), ConfigError);
  EXPECT_THROW(CameraModel("pinhole", "none", 100, 100, {100, 100, 50}, none), ConfigError);
  EXPECT_THROW(CameraModel("pinhole", "none", 100, 100, {100, 100, 50, std::nan("")}, none),
               ConfigError);
}

}  // namespace
}  // namespace etalon
