#include "etalon/simulation/stereo_renderer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/errors.h"
#include "random.h"
#include "rendered_room.h"

namespace etalon {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using PlacedSolid = RenderedRoom::PlacedSolid;
using Ray = RenderedRoom::Ray;  // one goes through one point of a pixel

constexpr int kTile = 16;      // px
constexpr int kSubpixels = 4;  // a pixel, on a 2x2 grid

}  // namespace

struct StereoRenderer::Impl {
  Impl(const Room& room, const RenderOptions& render_options)
      : options(render_options), scene(room, render_options.seed) {}

  RenderOptions options;
  RenderedRoom scene;
  struct Camera {
    int width, height;
    SE3 T_BC;
    std::vector<Ray> rays;    // kSubpixels a pixel
    std::vector<float> gain;  // of vignetting

    size_t index(int x, int y) const {
      return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
    }
  };
  std::array<Camera, 2> cameras;

  struct Pass {  // one instant
    Eigen::Matrix3f R_WC;
    Vector3f origin;  // of the camera, in the scene
    int first_subpixel, subpixels;
    std::vector<PlacedSolid> placed;
  };

  void makeRays(const CameraCalibration& calibration, Camera* camera) const;
  std::vector<Pass> passesOf(const Camera& camera, const SimulatedTrajectory& trajectory,
                             TimeNs t) const;
  void drawTile(const Camera& camera, const Pass& pass, int x0, int y0, float* sum) const;
  void solidsInTile(const Camera& camera, const Pass& pass, int x0, int y0, int x1, int y1,
                    std::vector<PlacedSolid>* found) const;
};

void StereoRenderer::Impl::makeRays(const CameraCalibration& calibration, Camera* camera) const {
  const CameraModel& model = calibration.model;
  camera->width = model.width();
  camera->height = model.height();
  camera->T_BC = calibration.T_BC;
  const Eigen::Vector2d& centre = model.principalPoint();
  const double corner2 = std::pow(std::hypot(0.5 * camera->width, 0.5 * camera->height), 2);
  for (int y = 0; y < camera->height; ++y) {
    for (int x = 0; x < camera->width; ++x) {
      for (int k = 0; k < kSubpixels; ++k) {
        const Eigen::Vector2d pixel(x + (k % 2 == 0 ? -0.25 : 0.25), y + (k < 2 ? -0.25 : 0.25));
        Eigen::Matrix2d J;
        const auto direction = model.measure(pixel, &J);
        if (!direction && model.isPerspective()) {
          throw ConfigError("pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                            ") cannot be undistorted with this calibration; nothing to render");
        }
        Ray ray;
        if (direction) {
          const Vector3d along = direction->ray();
          ray.direction = along.cast<float>();
          ray.spread = static_cast<float>(0.5 / std::sqrt(J.determinant()));
          ray.length = static_cast<float>(along.norm());
        }
        camera->rays.push_back(ray);
      }
      const double r2 = std::pow(x - centre.x(), 2) + std::pow(y - centre.y(), 2);
      camera->gain.push_back(
          static_cast<float>(1.0 - options.vignetting * std::min(1.0, r2 / corner2)));
    }
  }
}

std::vector<StereoRenderer::Impl::Pass> StereoRenderer::Impl::passesOf(
    const Camera& camera, const SimulatedTrajectory& trajectory, TimeNs t) const {
  const bool blur = options.blur_samples > 1;
  const int count = blur ? (options.blur_samples + kSubpixels - 1) / kSubpixels * kSubpixels : 1;
  std::vector<Pass> passes;
  for (int i = 0; i < count; ++i) {
    const double share = (i + 0.5) / count - 0.5;
    const TimeNs instant = blur ? t + durationNs(share * options.exposure_ms * 1e-3) : t;
    const SE3 T_WC = trajectory.at(instant).T_WB * camera.T_BC;
    Pass pass;
    pass.R_WC = T_WC.R.cast<float>();
    pass.origin = scene.inRoom(T_WC.t);
    pass.first_subpixel = blur ? i % kSubpixels : 0;
    pass.subpixels = blur ? 1 : kSubpixels;
    pass.placed = scene.placed(pass.origin);
    passes.push_back(std::move(pass));
  }
  return passes;
}

/** The solids whose enclosing sphere meets the cone around the tile's rays. */
void StereoRenderer::Impl::solidsInTile(const Camera& camera, const Pass& pass, int x0, int y0,
                                        int x1, int y1, std::vector<PlacedSolid>* found) const {
  found->clear();
  const auto direction = [&](int x, int y, int k) {
    const Ray& r = camera.rays[camera.index(x, y) * kSubpixels + k];
    return Vector3f(r.direction.normalized());
  };
  const std::array<Vector3f, 4> corners = {direction(x0, y0, 0), direction(x1 - 1, y0, 1),
                                           direction(x0, y1 - 1, 2), direction(x1 - 1, y1 - 1, 3)};
  const bool dark =
      std::any_of(corners.begin(), corners.end(), [](const Vector3f& c) { return c.isZero(); });
  if (dark) {  // at the edge of the lens: every solid
    *found = pass.placed;
    return;
  }
  const Vector3f axis = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
  float cosine = 1.0f;
  for (const Vector3f& c : corners) cosine = std::min(cosine, axis.dot(c));
  // Distorted tile edges bulge beyond the corners' cone by far less than this.
  const float half_angle = 1.1f * std::acos(std::clamp(cosine, -1.0f, 1.0f)) + 0.002f;
  const Vector3f axis_W = pass.R_WC * axis;
  for (const PlacedSolid& placed : pass.placed) {
    const Vector3f to = placed.solid->centre - pass.origin;
    const float distance = to.norm();
    if (distance > placed.solid->radius) {
      const float off = std::acos(std::clamp(axis_W.dot(to) / distance, -1.0f, 1.0f));
      if (off > half_angle + std::asin(placed.solid->radius / distance)) continue;
    }
    found->push_back(placed);
  }
}

void StereoRenderer::Impl::drawTile(const Camera& camera, const Pass& pass, int x0, int y0,
                                    float* sum) const {
  const int x1 = std::min(x0 + kTile, camera.width), y1 = std::min(y0 + kTile, camera.height);
  std::vector<PlacedSolid> candidates;
  solidsInTile(camera, pass, x0, y0, x1, y1, &candidates);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const size_t pixel = camera.index(x, y);
      const Ray* rays = &camera.rays[pixel * kSubpixels + pass.first_subpixel];
      sum[pixel] += scene.brightness(pass.origin, candidates, pass.R_WC, rays, pass.subpixels);
    }
  }
}

StereoRenderer::StereoRenderer(const Room& room, const StereoInertialCalibration& calibration,
                               const RenderOptions& options) {
  const auto in = [](double x, double low, double high) { return x >= low && x <= high; };
  if (!in(options.blur_samples, 0, 256) || !in(options.exposure_ms, 0.0, 1000.0) ||
      !in(options.noise_gray, 0.0, 100.0) || !in(options.shot_noise, 0.0, 10.0) ||
      !in(options.vignetting, 0.0, 0.9)) {
    throw ConfigError(
        "rendering needs 0 to 256 blur samples, an exposure of 0 to 1000 ms, noise of 0 to 100 "
        "gray levels and "
        "vignetting of 0 to 0.9");
  }
  impl_ = std::make_unique<Impl>(room, options);
  for (size_t i = 0; i < 2; ++i) impl_->makeRays(calibration.cameras[i], &impl_->cameras[i]);
}

StereoRenderer::~StereoRenderer() = default;
StereoRenderer::StereoRenderer(StereoRenderer&&) noexcept = default;
StereoRenderer& StereoRenderer::operator=(StereoRenderer&&) noexcept = default;

cv::Mat StereoRenderer::render(size_t camera_index, const SimulatedTrajectory& trajectory,
                               TimeNs t) const {
  const Impl::Camera& camera = impl_->cameras.at(camera_index);
  const RenderOptions& options = impl_->options;
  std::vector<float> sum(camera.gain.size(), 0.0f);
  int samples = 0;
  for (const Impl::Pass& pass : impl_->passesOf(camera, trajectory, t)) {
    samples += pass.subpixels;
    for (int y = 0; y < camera.height; y += kTile) {
      for (int x = 0; x < camera.width; x += kTile) impl_->drawTile(camera, pass, x, y, sum.data());
    }
  }
  cv::Mat image(camera.height, camera.width, CV_8UC1);
  const std::uint64_t key = mixBits(mixBits(options.seed ^ kImageNoiseStream) +
                                    2 * static_cast<std::uint64_t>(t) + camera_index)
                            << 20;
  const float dark = static_cast<float>(options.noise_gray * options.noise_gray);
  const float shot = static_cast<float>(options.shot_noise);
  for (size_t i = 0; i < sum.size(); ++i) {
    const float gray = sum[i] / static_cast<float>(samples) * camera.gain[i];
    const float noisy = gray + std::sqrt(dark + shot * gray) * nearlyNormal(key + i);
    image.data[i] = cv::saturate_cast<std::uint8_t>(noisy);
  }
  return image;
}

}  // namespace etalon
