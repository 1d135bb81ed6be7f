#include "stereo_matcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace etalon {

namespace {

constexpr int kSearchLevel = 1;      // half resolution
constexpr int kSearchRadius = 4;     // 9 x 9 patch
constexpr double kSearchStep = 1.0;  // px at that level
constexpr int kSearchSide = 2 * kSearchRadius + 1;
constexpr int kSearchCount = kSearchSide * kSearchSide;

/** The upper left corner of the patch around `centre` (rounded); null if it leaves the image. */
const uchar* cornerOfPatch(const cv::Mat& image, const cv::Point2f& centre) {
  const int x0 = cvRound(centre.x) - kSearchRadius, y0 = cvRound(centre.y) - kSearchRadius;
  if (x0 < 0 || y0 < 0 || x0 + kSearchSide > image.cols || y0 + kSearchSide > image.rows)
    return nullptr;
  return image.ptr<uchar>(y0) + x0;
}

/**
 * Correlations of a patch with others, in integers: `deviations` are kSearchCount times the gray
 * levels less their mean, up to 81 * 255, so that a sum of 81 products with gray levels is below
 * 2^31.
 */
struct SearchReference {
  std::array<int, kSearchCount> deviations;
  double norm = 0.0;  ///< of the gray levels less their mean; 0: no patch, or no contrast
};

/** Squared norm of gray levels less their mean, by their sum and the sum of their squares; 0 with a
 * standard deviation under one gray level. */
double squaredContrast(int sum, int squares) {
  const double contrast = squares - static_cast<double>(sum) * sum / kSearchCount;
  return contrast < kSearchCount ? 0.0 : contrast;
}

/** Of the patch around `centre`. */
SearchReference searchReference(const cv::Mat& image, const cv::Point2f& centre) {
  SearchReference reference;
  const uchar* corner = cornerOfPatch(image, centre);
  if (!corner) return reference;
  int sum = 0, squares = 0;
  for (int y = 0; y < kSearchSide; ++y)
    for (int x = 0; x < kSearchSide; ++x) {
      const int gray = corner[y * image.step + x];
      reference.deviations[y * kSearchSide + x] = kSearchCount * gray;
      sum += gray;
      squares += gray * gray;
    }
  for (int& deviation : reference.deviations) deviation -= sum;
  reference.norm = std::sqrt(squaredContrast(sum, squares));
  return reference;
}

/** Normalised correlation with the patch around `centre`; -1 if it leaves the image or has no
 * contrast. */
double correlation(const SearchReference& reference, const cv::Mat& image,
                   const cv::Point2f& centre) {
  const uchar* corner = cornerOfPatch(image, centre);
  if (!corner) return -1.0;
  int sum = 0, squares = 0, products = 0;
  for (int y = 0; y < kSearchSide; ++y, corner += image.step)
    for (int x = 0; x < kSearchSide; ++x) {
      const int gray = corner[x];
      sum += gray;
      squares += gray * gray;
      products += gray * reference.deviations[y * kSearchSide + x];
    }
  const double contrast = squaredContrast(sum, squares);
  if (contrast == 0.0) return -1.0;
  return products / (kSearchCount * reference.norm * std::sqrt(contrast));
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
  constexpr float kScale = 1.0F / (1 << kSearchLevel);
  const SearchReference reference = searchReference(left, query.left * kScale);
  if (reference.norm == 0.0) return -1.0;
  double best = -1.0, best_correlation = options_.min_correlation;
  // A step is about 2 px, so there are at most as many as fit into the width of the image.
  const auto [least, most] = visibleInverseDepths(query.left_ray);
  for (double inverse_depth = 0.0; inverse_depth <= most;
       inverse_depth += searchStep(query.left_ray, inverse_depth)) {
    if (inverse_depth < least) continue;
    cv::Point2f pixel;
    if (!rightPixel(query.left_ray, inverse_depth, &pixel)) continue;
    const double found = correlation(reference, right, pixel * kScale);
    if (found > best_correlation) {
      best_correlation = found;
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
      query.patch->align(right, &pose, options_.anchor_iterations, options_.anchor_epsilon_px);
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
    if (!matches[i].found && query.search)
      matches[i] = align(right, query, searchInverseDepth(left_half, right_half, query));
  }
  return matches;
}

}  // namespace etalon
