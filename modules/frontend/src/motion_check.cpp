#include "motion_check.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "etalon/core/se3.h"
#include "etalon/core/so3.h"

namespace etalon {

namespace {

constexpr size_t kEnough = 20;           // rays; fewer are better judged by the estimator
constexpr double kFirstScalePx = 32.0;   // flow of a near landmark between two frames
constexpr int kIterations = 12;          // the last of them at the final scale
constexpr double kLeastAgreement = 0.5;  // share of inliers below which the motion is not believed
constexpr double kNearestDepth = 0.05;   // of the depth before: behind or at the camera otherwise

/** Where the motion takes the landmark, scaled by its inverse depth, in the frame M of where it is
 * seen now. */
Eigen::Vector3d moved(const TrackedRay& ray, const SE3& T) {
  return ray.now.R_MC * (T.R * ray.before + ray.inverse_depth * T.t);
}

double errorPx(const TrackedRay& ray, const SE3& T, double focal_px) {
  const Eigen::Vector3d q = moved(ray, T);
  if (ray.inverse_depth >= 0.0)
    return q.z() > kNearestDepth ? focal_px * (q.hnormalized() - ray.now.xy).norm() : HUGE_VAL;
  const Eigen::Vector3d line = ray.now.R_MC * T.t.cross(T.R * ray.before);
  const double length = line.head<2>().norm();
  return length > 0.0 ? focal_px * std::abs(line.dot(ray.now.xy.homogeneous())) / length : 0.0;
}

std::optional<SE3> estimateMotion(const std::vector<TrackedRay>& rays, const Eigen::Matrix3d& R,
                                  double focal_px, double threshold_px) {
  SE3 T(R, Eigen::Vector3d::Zero());
  double scale = kFirstScalePx;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix<double, 6, 6> H = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    for (const TrackedRay& ray : rays) {
      if (ray.inverse_depth < 0.0) continue;
      const Eigen::Vector3d q = moved(ray, T);
      if (q.z() <= kNearestDepth) continue;
      Eigen::Matrix<double, 2, 3> J_q;
      J_q << 1.0, 0.0, -q.x() / q.z(), 0.0, 1.0, -q.y() / q.z();
      J_q *= focal_px / q.z();
      const Eigen::Matrix<double, 2, 3> J_C = J_q * ray.now.R_MC;
      Eigen::Matrix<double, 2, 6> J;
      J << -J_C * T.R * hat(ray.before), J_C * ray.inverse_depth;
      const Eigen::Vector2d r = focal_px * (q.hnormalized() - ray.now.xy);
      const double weight = 1.0 / (1.0 + r.squaredNorm() / (scale * scale));
      H += weight * J.transpose() * J;
      b -= weight * J.transpose() * r;
    }
    const Eigen::Matrix<double, 6, 1> step = H.ldlt().solve(b);
    if (!step.allFinite()) return std::nullopt;
    T.R = T.R * expSO3(step.head<3>());
    T.t += step.tail<3>();
    scale = std::max(0.5 * scale, threshold_px);
  }
  size_t known = 0, agreeing = 0;
  for (const TrackedRay& ray : rays)
    if (ray.inverse_depth >= 0.0) {
      ++known;
      agreeing += errorPx(ray, T, focal_px) <= threshold_px;
    }
  if (static_cast<double>(agreeing) < kLeastAgreement * static_cast<double>(known))
    return std::nullopt;
  return T;
}

std::vector<char> agreeWithFundamentalMatrix(const std::vector<TrackedRay>& rays, double focal_px,
                                             double threshold_px) {
  const auto pixel = [focal_px](const Eigen::Vector3d& ray) {
    const Eigen::Vector2d xy = ray.hnormalized();
    return cv::Point2f(static_cast<float>(focal_px * xy.x()),
                       static_cast<float>(focal_px * xy.y()));
  };
  std::vector<cv::Point2f> before, now;
  std::vector<size_t> index;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d ray = rays[i].now.ray();
    if (!meetsPlane(rays[i].before) || !meetsPlane(ray)) continue;
    before.push_back(pixel(rays[i].before));
    now.push_back(pixel(ray));
    index.push_back(i);
  }
  std::vector<char> agree(rays.size(), 1);
  if (index.size() < kEnough) return agree;
  std::vector<uchar> inlier;
  cv::findFundamentalMat(before, now, cv::FM_RANSAC, threshold_px, 0.99, inlier);
  if (inlier.size() == index.size())
    for (size_t j = 0; j < index.size(); ++j) agree[index[j]] = static_cast<char>(inlier[j]);
  return agree;
}

}  // namespace

std::vector<char> agreeWithMotion(const std::vector<TrackedRay>& rays,
                                  const Eigen::Matrix3d& R_now_before, double focal_px,
                                  double threshold_px) {
  const auto known = std::count_if(rays.begin(), rays.end(),
                                   [](const TrackedRay& ray) { return ray.inverse_depth >= 0.0; });
  if (static_cast<size_t>(known) >= kEnough) {
    if (const auto T = estimateMotion(rays, R_now_before, focal_px, threshold_px)) {
      std::vector<char> agree;
      for (const TrackedRay& ray : rays)
        agree.push_back(errorPx(ray, *T, focal_px) <= threshold_px);
      return agree;
    }
  }
  return agreeWithFundamentalMatrix(rays, focal_px, threshold_px);
}

}  // namespace etalon
