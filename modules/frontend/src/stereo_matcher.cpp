#include "stereo_matcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace etalon {

namespace {

constexpr int kSearchLevel = 1;      // half resolution
constexpr int kSearchRadius = 4;     // 9 x 9 patch
constexpr double kSearchStep = 1.0;  // px at that level

/** Copies the patch around `centre` (rounded) less its mean; false outside the image or without
 * contrast. */
bool normalizedPatch(const cv::Mat& image, const cv::Point2f& centre, float* patch) {
  const int x0 = cvRound(centre.x) - kSearchRadius, y0 = cvRound(centre.y) - kSearchRadius;
  constexpr int kSide = 2 * kSearchRadius + 1;
  if (x0 < 0 || y0 < 0 || x0 + kSide > image.cols || y0 + kSide > image.rows) return false;
  float sum = 0.0F;
  for (int y = 0; y < kSide; ++y) {
    const uchar* row = image.ptr<uchar>(y0 + y) + x0;
    for (int x = 0; x < kSide; ++x) sum += patch[y * kSide + x] = row[x];
  }
  constexpr int kCount = kSide * kSide;
  const float mean = sum / kCount;
  float squares = 0.0F;
  for (int i = 0; i < kCount; ++i) {
    patch[i] -= mean;
    squares += patch[i] * patch[i];
  }
  if (squares < kCount) return false;  // standard deviation under one gray level
  const float scale = 1.0F / std::sqrt(squares);
  for (int i = 0; i < kCount; ++i) patch[i] *= scale;
  return true;
}

/** A box around what the image shows, in the plane z = 1; with strong distortion a wide one. */
Eigen::AlignedBox2d normalizedBounds(const CameraModel& camera) {
  constexpr int kPointsASide = 20;
  const Eigen::AlignedBox2d wide(Eigen::Vector2d(-10.0, -10.0), Eigen::Vector2d(10.0, 10.0));
  Eigen::AlignedBox2d box;
  for (int i = 0; i <= kPointsASide; ++i) {
    const double u = camera.width() * static_cast<double>(i) / kPointsASide;
    const double v = camera.height() * static_cast<double>(i) / kPointsASide;
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(u, 0.0), Eigen::Vector2d(u, camera.height()), Eigen::Vector2d(0.0, v),
          Eigen::Vector2d(camera.width(), v)}) {
      const auto ray = camera.unproject(pixel);
      if (!ray || !camera.isPerspective()) return wide;
      box.extend(ray->head<2>());
    }
  }
  // Between the points of the border, and for the rounding of the inverse.
  const Eigen::Vector2d margin = 0.02 * box.sizes();
  return {box.min() - margin, box.max() + margin};
}

}  // namespace

StereoMatcher::StereoMatcher(const StereoInertialCalibration& calibration,
                             const StereoTrackerOptions& options)
    : calibration_(calibration),
      options_(options),
      T_C1C0_(calibration.rightFromLeft()),
      right_xy_(normalizedBounds(calibration.cameras[1].model)) {
  focal_ = 0.5 * calibration.cameras[1].model.focal().sum();
}

bool StereoMatcher::rightPixel(const Eigen::Vector3d& left_ray, double inverse_depth,
                               cv::Point2f* right) const {
  // Scaled by the inverse depth, so that infinity is a point like any other.
  const Eigen::Vector3d p = T_C1C0_.R * left_ray + inverse_depth * T_C1C0_.t;
  const auto pixel = calibration_.cameras[1].model.project(p);
  if (!pixel || !calibration_.cameras[1].model.inImage(*pixel)) return false;
  *right = cv::Point2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
  return true;
}

std::pair<double, double> StereoMatcher::visibleInverseDepths(
    const Eigen::Vector3d& left_ray) const {
  const Eigen::Vector3d f = T_C1C0_.R * left_ray;
  const Eigen::Vector3d& t = T_C1C0_.t;
  double least = 0.0, most = 1.0 / options_.min_depth_m;
  if (!calibration_.cameras[1].model.isPerspective()) return {least, most};
  // Of p(rho) = f + rho t, every bound x >= x_min z etc. is linear: a + rho b >= 0.
  const auto bound = [&least, &most](double a, double b) {
    if (b > 0.0)
      least = std::max(least, -a / b);
    else if (b < 0.0)
      most = std::min(most, -a / b);
    else if (a < 0.0)
      most = -1.0;
  };
  for (int i = 0; i < 2; ++i) {
    bound(f[i] - right_xy_.min()[i] * f.z(), t[i] - right_xy_.min()[i] * t.z());
    bound(right_xy_.max()[i] * f.z() - f[i], right_xy_.max()[i] * t.z() - t[i]);
  }
  bound(f.z(), t.z());
  return {least, most};
}

double StereoMatcher::searchStep(const Eigen::Vector3d& left_ray, double inverse_depth) const {
  constexpr double kStepPx = kSearchStep * (1 << kSearchLevel);
  if (calibration_.cameras[1].model.isPerspective())
    return kStepPx / (focal_ * calibration_.baseline());
  // Pixels are even in the angle: that of p = f + rho t moves by |f x t| / p^2 a unit of rho.
  const Eigen::Vector3d f = T_C1C0_.R * left_ray;
  return kStepPx / focal_ * (f + inverse_depth * T_C1C0_.t).squaredNorm() /
         std::max(1e-9, f.cross(T_C1C0_.t).norm());
}

double StereoMatcher::searchInverseDepth(const cv::Mat& left, const cv::Mat& right,
                                         const StereoQuery& query) const {
  constexpr int kCount = (2 * kSearchRadius + 1) * (2 * kSearchRadius + 1);
  constexpr float kScale = 1.0F / (1 << kSearchLevel);
  float reference[kCount], candidate[kCount];
  if (!normalizedPatch(left, query.left * kScale, reference)) return -1.0;
  double best = -1.0, best_correlation = options_.min_correlation;
  // A step is about 2 px, so there are at most as many as fit into the width of the image.
  const auto [least, most] = visibleInverseDepths(query.left_ray);
  for (double inverse_depth = 0.0; inverse_depth <= most;
       inverse_depth += searchStep(query.left_ray, inverse_depth)) {
    if (inverse_depth < least) continue;
    cv::Point2f pixel;
    if (!rightPixel(query.left_ray, inverse_depth, &pixel) ||
        !normalizedPatch(right, pixel * kScale, candidate))
      continue;
    float correlation = 0.0F;
    for (int i = 0; i < kCount; ++i) correlation += reference[i] * candidate[i];
    if (correlation > best_correlation) {
      best_correlation = correlation;
      best = inverse_depth;
    }
  }
  return best;
}

StereoMatch StereoMatcher::check(const StereoQuery& query, const cv::Point2f& right) const {
  StereoMatch match;
  const CameraModel& camera = calibration_.cameras[1].model;
  const Eigen::Vector2d pixel(right.x, right.y);
  if (!camera.inImage(pixel)) return match;
  const auto direction = camera.measure(pixel);
  if (!direction) return match;
  const Eigen::Vector3d f0 = T_C1C0_.R * query.left_ray;
  const Eigen::Vector3d f1 = direction->ray();
  // Distance from the epipolar line in the plane of the measured direction, in pixels.
  const Eigen::Vector3d line = direction->R_MC * T_C1C0_.t.cross(f0);
  const double distance_px =
      std::abs(line.dot(direction->xy.homogeneous())) / line.head<2>().norm() * focal_;
  if (distance_px > options_.epipolar_px) return match;
  // f1 x (f0 + inverse_depth t) = 0, least squares.
  const Eigen::Vector3d a = f1.cross(T_C1C0_.t), b = f1.cross(f0);
  const double inverse_depth = -a.dot(b) / a.squaredNorm();
  // Half a pixel of noise may put a landmark at great distance beyond infinity.
  const double slack = 0.5 / (focal_ * calibration_.baseline());
  if (inverse_depth < -slack || inverse_depth > 1.0 / options_.min_depth_m) return match;
  match.found = true;
  match.right = right;
  match.inverse_depth = std::max(0.0, inverse_depth);
  return match;
}

StereoMatch StereoMatcher::align(const cv::Mat& right, const StereoQuery& query,
                                 double inverse_depth) const {
  cv::Point2f guess;
  if (inverse_depth < 0.0 || !rightPixel(query.left_ray, inverse_depth, &guess)) return {};
  PatchPose pose{{guess.x, guess.y}, query.A};
  const double correlation =
      query.patch->align(right, &pose, options_.anchor_iterations, options_.klt_epsilon_px);
  if (correlation < options_.min_correlation ||
      (pose.centre - Eigen::Vector2d(guess.x, guess.y)).norm() > options_.stereo_reach_px)
    return {};
  StereoMatch match =
      check(query, {static_cast<float>(pose.centre.x()), static_cast<float>(pose.centre.y())});
  match.A = pose.A;
  return match;
}

std::vector<StereoMatch> StereoMatcher::match(const cv::Mat& left_half, const cv::Mat& right,
                                              const cv::Mat& right_half,
                                              const std::vector<StereoQuery>& queries) const {
  std::vector<StereoMatch> matches(queries.size());
  for (size_t i = 0; i < queries.size(); ++i) {
    const StereoQuery& query = queries[i];
    if (!query.patch->valid()) continue;
    matches[i] = align(right, query, query.inverse_depth);
    if (!matches[i].found)
      matches[i] = align(right, query, searchInverseDepth(left_half, right_half, query));
  }
  return matches;
}

}  // namespace etalon
