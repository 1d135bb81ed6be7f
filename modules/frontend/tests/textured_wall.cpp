#include "textured_wall.h"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "etalon/core/so3.h"

namespace etalon {

namespace {
constexpr int kTextureSide = 2048;
// A texel is half a pixel of the left camera, and the texture is smooth over several of them, so
// that sampling it bilinearly costs no accuracy worth mentioning.
constexpr double kTexelsPerPixel = 2.0;
constexpr double kSmoothing = 3.0;  ///< texels
}  // namespace

TexturedWall::TexturedWall(const StereoInertialCalibration& calibration, double depth_m,
                           double contrast, int seed)
    : calibration_(calibration),
      depth_m_(depth_m),
      texel_m_(depth_m / calibration.cameras[0].model.focal().x() / kTexelsPerPixel) {
  cv::RNG random(static_cast<uint64_t>(seed));
  cv::Mat fine(kTextureSide, kTextureSide, CV_32F), coarse(fine.size(), CV_32F);
  random.fill(fine, cv::RNG::NORMAL, 0.0, 1.0);
  random.fill(coarse, cv::RNG::NORMAL, 0.0, 1.0);
  cv::GaussianBlur(fine, fine, {}, kSmoothing);
  cv::GaussianBlur(coarse, coarse, {}, 4 * kSmoothing);
  // A blur by sigma divides the standard deviation of white noise by 2 sqrt(pi) sigma.
  const double unit = 2.0 * std::sqrt(CV_PI) * kSmoothing;
  texture_ = 128.0 + contrast * (25.0 * unit * fine + 20.0 * 4.0 * unit * coarse);
  for (size_t c = 0; c < 2; ++c) {
    const CameraModel& model = calibration_.cameras[c].model;
    rays_[c].create(model.height(), model.width(), CV_64FC3);
    for (int v = 0; v < model.height(); ++v)
      for (int u = 0; u < model.width(); ++u) {
        const Eigen::Vector3d ray = model.unproject(Eigen::Vector2d(u, v)).value();
        rays_[c].at<cv::Vec3d>(v, u) = {ray.x(), ray.y(), ray.z()};
      }
  }
}

cv::Mat TexturedWall::image(size_t camera, const SE3& T_WB) const {
  const SE3 T_WC = T_WB * calibration_.cameras[camera].T_BC;
  const cv::Mat& rays = rays_[camera];
  cv::Mat map(rays.size(), CV_32FC2), image;
  for (int v = 0; v < rays.rows; ++v)
    for (int u = 0; u < rays.cols; ++u) {
      const auto& ray_C = rays.at<cv::Vec3d>(v, u);
      const Eigen::Vector3d ray = T_WC.R * Eigen::Vector3d(ray_C[0], ray_C[1], ray_C[2]);
      const Eigen::Vector3d p = T_WC.t + ray * ((depth_m_ - T_WC.t.z()) / ray.z());
      map.at<cv::Vec2f>(v, u) = {static_cast<float>(p.x() / texel_m_ + kTextureSide / 2),
                                 static_cast<float>(p.y() / texel_m_ + kTextureSide / 2)};
    }
  // Bilinear by hand: cv::remap knows fractions of 1/32 pixel only.
  image.create(rays.size(), CV_8UC1);
  image.setTo(0);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const auto& at = map.at<cv::Vec2f>(v, u);
      const int x = cvFloor(at[0]), y = cvFloor(at[1]);
      if (x < 0 || y < 0 || x + 1 >= kTextureSide || y + 1 >= kTextureSide) continue;
      const float a = at[0] - static_cast<float>(x), b = at[1] - static_cast<float>(y);
      const float top = (1 - a) * texture_.at<float>(y, x) + a * texture_.at<float>(y, x + 1);
      const float low =
          (1 - a) * texture_.at<float>(y + 1, x) + a * texture_.at<float>(y + 1, x + 1);
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>((1 - b) * top + b * low);
    }
  return image;
}

Eigen::Vector3d TexturedWall::pointBehind(const Eigen::Vector2d& left_pixel,
                                          const SE3& T_WB) const {
  const SE3 T_WC = T_WB * calibration_.cameras[0].T_BC;
  const Eigen::Vector3d ray = T_WC.R * calibration_.cameras[0].model.unproject(left_pixel).value();
  return T_WC.t + ray * ((depth_m_ - T_WC.t.z()) / ray.z());
}

Eigen::Vector2d TexturedWall::pixelOf(const Eigen::Vector3d& p_W, size_t camera,
                                      const SE3& T_WB) const {
  const SE3 T_WC = T_WB * calibration_.cameras[camera].T_BC;
  return calibration_.cameras[camera].model.project(T_WC.inverse() * p_W).value();
}

StereoInertialCalibration smallRig() {
  StereoInertialCalibration calibration;
  for (CameraCalibration& camera : calibration.cameras)
    camera.model = CameraModel("pinhole", "radial-tangential", 376, 240,
                               {229.3, 228.6, 183.5, 124.0}, {-0.283, 0.074, 1.9e-4, 1.8e-5});
  calibration.cameras[1].model = calibration.cameras[1].model.with("cu", 189.0);
  // Not quite parallel, as real rigs are.
  calibration.cameras[1].T_BC = SE3(expSO3({0.002, -0.014, 0.003}), {0.11, 0.0004, -0.001});
  return calibration;
}

}  // namespace etalon
