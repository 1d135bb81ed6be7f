#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/fisheye_rig.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/room.h"
#include "etalon/simulation/stereo_renderer.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class Renderer : public ::testing::Test {
 protected:
  Renderer() : trajectory_(options()), rig_(eurocCalibration()), room_(makeRoom(trajectory_)) {}

  static ProfileOptions options() {
    ProfileOptions o;
    o.profile = MotionProfile::kAggressive;
    o.duration_s = 8.0;
    return o;
  }
  static RenderOptions noiseFree() {
    RenderOptions o;
    o.noise_gray = o.shot_noise = 0.0;
    return o;
  }
  SE3 cameraPose(size_t camera, TimeNs t) const {
    return trajectory_.at(t).T_WB * rig_.cameras[camera].T_BC;
  }
  std::optional<Vector3d> surfaceAt(size_t camera, TimeNs t, const Vector2d& pixel) const {
    const std::optional<Vector3d> ray = rig_.cameras[camera].model.unproject(pixel);
    const SE3 T_WC = cameraPose(camera, t);
    return room_.firstHit(T_WC.t, T_WC.R * ray.value());
  }

  /** Corners of one image, found again in another by KLT and by geometry: found - predicted, px,
   * sorted by size. */
  std::vector<Vector2d> disagreement(const StereoRenderer& renderer, size_t camera_a, TimeNs t_a,
                                     size_t camera_b, TimeNs t_b, bool turned = false) const {
    const cv::Mat a = renderer.render(camera_a, trajectory_, t_a);
    cv::Mat b = renderer.render(camera_b, trajectory_, t_b);
    if (turned) cv::rotate(b, b, cv::ROTATE_180);
    std::vector<cv::Point2f> corners, from, predicted;
    cv::goodFeaturesToTrack(a, corners, 600, 0.01, 12);
    const CameraModel& model = rig_.cameras[camera_b].model;
    for (const cv::Point2f& corner : corners) {
      const auto p_W = surfaceAt(camera_a, t_a, {corner.x, corner.y});
      const auto pixel = model.project(cameraPose(camera_b, t_b).inverse() * p_W.value());
      if (!pixel || !model.inImage(*pixel, 20.0)) continue;
      // In sight of both: what the second camera sees there is the same point.
      if ((surfaceAt(camera_b, t_b, *pixel).value() - *p_W).norm() > 1e-3) continue;
      from.push_back(corner);
      const Vector2d expected =
          turned ? Vector2d(Vector2d(model.width() - 1, model.height() - 1) - *pixel) : *pixel;
      predicted.emplace_back(static_cast<float>(expected.x()), static_cast<float>(expected.y()));
    }
    std::vector<cv::Point2f> found = predicted;
    std::vector<std::uint8_t> status;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(
        a, b, from, found, status, error, cv::Size(15, 15), 0,
        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 60, 1e-4),
        cv::OPTFLOW_USE_INITIAL_FLOW);
    std::vector<Vector2d> differences;
    for (size_t i = 0; i < found.size(); ++i) {
      const Vector2d d(found[i].x - predicted[i].x, found[i].y - predicted[i].y);
      if (status[i] && d.norm() < 3.0) differences.push_back(d);
    }
    return differences;
  }

  void expectAgreement(const std::vector<Vector2d>& differences) const {
    ASSERT_GT(differences.size(), 150u);
    std::vector<double> x, y, norm;
    for (const Vector2d& d : differences) {
      x.push_back(d.x());
      y.push_back(d.y());
      norm.push_back(d.norm());
    }
    // KLT itself is good to a few hundredths of a pixel (its window is not warped); a half-pixel
    // error of the renderer between rays and projection would show as 0.5 px, a wrong baseline or
    // distortion as more.
    EXPECT_LT(std::abs(median(x)), 0.03);
    EXPECT_LT(std::abs(median(y)), 0.03);
    EXPECT_LT(median(norm), 0.1);
  }

  TimeNs instant(double seconds) const { return trajectory_.start() + durationNs(seconds); }

  ProfileTrajectory trajectory_;
  StereoInertialCalibration rig_;
  Room room_;
};

TEST_F(Renderer, RightImageAgreesWithProjectedLeftCorners) {
  const StereoRenderer renderer(room_, rig_, noiseFree());
  for (double s : {0.0, 5.0, 7.0}) {
    expectAgreement(disagreement(renderer, 0, instant(s), 1, instant(s)));
  }
}

TEST_F(Renderer, NextImageAgreesWithProjectedCorners) {
  const StereoRenderer renderer(room_, rig_, noiseFree());
  expectAgreement(disagreement(renderer, 0, instant(5.0), 0, instant(5.05)));
}

// A shift common to all images, such as half a pixel, hides from the tests above. Here the second
// camera is the first one turned by half a turn about its optical axis, and its image is turned
// back: a common shift would show twofold.
TEST_F(Renderer, TurnedImageAgreesWithProjectedCorners) {
  rig_.cameras[1] = rig_.cameras[0];
  rig_.cameras[1].T_BC.R = rig_.cameras[0].T_BC.R * expSO3({0.0, 0.0, 3.14159265358979323846});
  const StereoRenderer renderer(room_, rig_, noiseFree());
  expectAgreement(disagreement(renderer, 0, instant(5.0), 1, instant(5.0), true));
}

TEST_F(Renderer, FisheyeImagesAgreeWithProjectedCorners) {
  rig_ = fisheyeCalibration();
  const StereoRenderer renderer(room_, rig_, noiseFree());
  expectAgreement(disagreement(renderer, 0, instant(5.0), 1, instant(5.0)));
  expectAgreement(disagreement(renderer, 0, instant(5.0), 0, instant(5.05)));
}

TEST_F(Renderer, IsBlackBeyondTheLens) {
  // theta_d = theta (1 - 0.1 theta^2) rises up to 104.6 degrees, 232 px from the centre.
  for (CameraCalibration& camera : rig_.cameras)
    camera.model = CameraModel("pinhole", "equidistant", 512, 512, {191.0, 191.0, 255.5, 255.5},
                               {-0.1, 0.0, 0.0, 0.0});
  const StereoRenderer renderer(room_, rig_, noiseFree());
  const cv::Mat image = renderer.render(0, trajectory_, instant(5.0));
  for (int y = 0; y < image.rows; y += 3)
    for (int x = 0; x < image.cols; x += 3) {
      const double radius = std::hypot(x - 255.5, y - 255.5);
      if (radius > 230.0 && radius < 234.0) continue;
      EXPECT_EQ(image.at<std::uint8_t>(y, x) > 0, radius < 232.0) << x << " " << y;
    }
}

TEST_F(Renderer, HasTextureEverywhere) {
  const StereoRenderer renderer(room_, rig_);
  for (double s : {0.0, 4.5, 6.0, 7.5}) {
    const cv::Mat image = renderer.render(0, trajectory_, instant(s));
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image, corners, 1000, 0.01, 10);
    EXPECT_GT(corners.size(), 300u);
    int filled = 0;
    std::vector<int> cells(48, 0);  // 8 x 6
    for (const cv::Point2f& c : corners) {
      ++cells[static_cast<int>(c.x) / 94 + 8 * (static_cast<int>(c.y) / 80)];
    }
    for (int count : cells) filled += count > 0;
    EXPECT_GE(filled, 44) << "cells of the image with a corner, of 48";
  }
}

TEST_F(Renderer, SameSeedSameImageBitForBit) {
  RenderOptions options;
  options.vignetting = 0.3;
  const StereoRenderer first(room_, rig_, options), second(room_, rig_, options);
  const cv::Mat a = first.render(1, trajectory_, instant(6.0));
  EXPECT_EQ(cv::norm(a, second.render(1, trajectory_, instant(6.0)), cv::NORM_INF), 0.0);
  options.seed = 2;
  const StereoRenderer other(room_, rig_, options);
  EXPECT_GT(cv::norm(a, other.render(1, trajectory_, instant(6.0)), cv::NORM_INF), 50.0);
}

TEST_F(Renderer, NoiseHasItsStandardDeviation) {
  RenderOptions noisy = noiseFree();
  noisy.noise_gray = 4.0;
  const StereoRenderer clean(room_, rig_, noiseFree()), grainy(room_, rig_, noisy);
  cv::Mat a, b;
  clean.render(0, trajectory_, instant(5.0)).convertTo(a, CV_64F);
  grainy.render(0, trajectory_, instant(5.0)).convertTo(b, CV_64F);
  cv::Scalar mean, sigma;
  // Where neither black nor white clips.
  cv::meanStdDev(b - a, mean, sigma, (a > 20.0) & (a < 235.0));
  // 300,000 pixels; rounding to whole gray levels of both images adds 2/12 to the variance of 16.
  EXPECT_NEAR(mean[0], 0.0, 0.05);
  EXPECT_NEAR(sigma[0], std::sqrt(16.0 + 2.0 / 12.0), 0.05);
}

TEST_F(Renderer, BlurSmearsMotionOnly) {
  RenderOptions options = noiseFree();
  options.blur_samples = 8;
  options.exposure_ms = 20.0;
  const StereoRenderer sharp(room_, rig_, noiseFree()), blurred(room_, rig_, options);
  const auto sharpness = [&](const StereoRenderer& renderer, double s) {
    cv::Mat edges;
    cv::Laplacian(renderer.render(0, trajectory_, instant(s)), edges, CV_64F);
    return cv::mean(cv::abs(edges))[0];
  };
  // At rest all instants are the same; the order of summation is not.
  EXPECT_NEAR(sharpness(blurred, 0.5) / sharpness(sharp, 0.5), 1.0, 1e-3);
  EXPECT_LT(sharpness(blurred, 6.0), 0.9 * sharpness(sharp, 6.0));
}

TEST_F(Renderer, RefusesOptionsOutOfRange) {
  RenderOptions options;
  options.blur_samples = -1;
  EXPECT_THROW(StereoRenderer(room_, rig_, options), ConfigError);
}

TEST_F(Renderer, RoomLeavesTheFlightFree) {
  EXPECT_GE(room_.boxes.size(), 5u);
  for (TimeNs t = trajectory_.start(); t < trajectory_.end(); t += durationNs(0.05)) {
    const SE3 T_WB = trajectory_.at(t).T_WB;
    for (int axis = 0; axis < 3; ++axis) {
      for (double sign : {-1.0, 1.0}) {
        const Vector3d direction = sign * Vector3d::Unit(axis);
        const auto hit = room_.firstHit(T_WB.t, direction);
        ASSERT_TRUE(hit);
        EXPECT_GT((*hit - T_WB.t).norm(), 0.39);  // the floor at the start; all else is farther
      }
    }
  }
  EXPECT_FALSE(room_.firstHit(room_.high + Vector3d::Ones(), Vector3d::UnitX()));
}

}  // namespace
}  // namespace etalon
