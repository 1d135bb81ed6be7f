#include "etalon/map/view_geometry.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"

namespace etalon {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kBorderPx = 12.0;
constexpr double kMaxAngle = 35.0 / kDegreesPerRadian;
constexpr double kMaxScale = 2.0;

/** Offsets in the current image to those in the view, of a plane that faces the current camera. */
std::optional<Eigen::Matrix2d> warp(const CameraModel& camera, const SE3& T_VcNc,
                                    const Eigen::Vector2d& pixel, const Eigen::Vector3d& p_Nc) {
  constexpr double kStepPx = 4.0;
  Eigen::Matrix2d A;
  for (int i = 0; i < 2; ++i) {
    std::array<Eigen::Vector2d, 2> ends;
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector2d offset = (side ? kStepPx : -kStepPx) * Eigen::Vector2d::Unit(i);
      const auto ray = camera.unproject(pixel + offset);
      if (!ray) return std::nullopt;
      const auto projected =
          camera.project(T_VcNc * (*ray * (p_Nc.squaredNorm() / p_Nc.dot(*ray))));
      if (!projected) return std::nullopt;
      ends[side] = *projected;
    }
    A.col(i) = (ends[1] - ends[0]) / (2.0 * kStepPx);
  }
  return A;
}

/** The residual of a found pixel, and the covariance that pixel and landmark give it. */
struct Residual {
  Eigen::Vector2d r;              ///< whitened
  Eigen::Matrix<double, 2, 6> J;  ///< by T_NV
  Eigen::Matrix2d S;              ///< of r from pixel and landmark
};

std::optional<Residual> residualOf(const StereoInertialCalibration& calibration, size_t camera,
                                   const SE3& T_NV, const SeenLandmark& landmark,
                                   const ReprojectionMeasurement& measurement,
                                   double pixel_variance) {
  Residual out;
  Eigen::Matrix<double, 2, 3> J_landmark;
  if (!reprojectionResidual(calibration.cameras[camera].T_BC.inverse(), measurement, T_NV,
                            landmark.p_N, &out.r, &out.J, &J_landmark))
    return std::nullopt;
  out.S = J_landmark * landmark.covariance * J_landmark.transpose();
  out.S.diagonal().array() += pixel_variance;
  return out;
}

SE3 moved(const SE3& T, const Vector6d& d) {
  return {T.R * expSO3(d.head<3>()), T.t + d.tail<3>()};
}

/** How far the view is from its prediction. */
struct Alignment {
  Vector6d d = Vector6d::Zero();
  Matrix6d information = Matrix6d::Zero();
};

/** By Gauss-Newton with the Cauchy loss, from the prediction, which counts by its covariance. */
Alignment align(const StereoInertialCalibration& calibration, const OldView& view,
                const std::vector<SeenLandmark>& landmarks, const std::vector<FoundLandmark>& found,
                double pixel_variance) {
  constexpr int kSteps = 8;
  const Matrix6d prior = view.covariance.llt().solve(Matrix6d::Identity());
  Alignment at;
  for (int i = 0; i < kSteps; ++i) {
    Matrix6d H = prior;
    Vector6d g = prior * at.d;
    for (const FoundLandmark& f : found)
      for (size_t camera = 0; camera < (f.match.has_right ? 2u : 1u); ++camera) {
        const auto residual =
            residualOf(calibration, camera, moved(view.T_NV, at.d), landmarks[f.landmark],
                       f.measurements[camera], pixel_variance);
        if (!residual) continue;
        const Eigen::Matrix2d S_inverse = residual->S.inverse();
        const double weight = 1.0 / (1.0 + residual->r.dot(S_inverse * residual->r) / 4.0);
        H += weight * residual->J.transpose() * S_inverse * residual->J;
        g += weight * residual->J.transpose() * S_inverse * residual->r;
      }
    at.d -= H.llt().solve(g);
    at.information = H;
  }
  return at;
}

}  // namespace

SeenLandmark seenLandmark(const SE3& T_BC, LandmarkId id, const Eigen::Vector2d& pixel,
                          const Eigen::Vector3d& p_N, double sigma_distance,
                          double sigma_direction) {
  const Eigen::Vector3d ray = p_N - T_BC.t;
  const double across = std::pow(sigma_direction, 2) * ray.squaredNorm();
  SeenLandmark landmark{id, pixel, p_N, across * Eigen::Matrix3d::Identity()};
  landmark.covariance += std::pow(sigma_distance, 2) * ray * ray.transpose();
  return landmark;
}

OldView inverse(const OldView& view) {
  const SE3 T_VN = view.T_NV.inverse();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = -view.T_NV.R;
  J.bottomLeftCorner<3, 3>() = hat(T_VN.t);
  J.bottomRightCorner<3, 3>() = -T_VN.R;
  return {T_VN, J * view.covariance * J.transpose()};
}

bool isInView(const StereoInertialCalibration& calibration, const SE3& T_NV,
              const SeenLandmark& landmark) {
  const CameraCalibration& left = calibration.cameras[0];
  const SE3 T_VcN = (T_NV * left.T_BC).inverse();
  const Eigen::Vector3d ray = T_VcN.R * (landmark.p_N - left.T_BC.t);
  const Eigen::Vector3d p_Vc = T_VcN * landmark.p_N;
  const double here = ray.squaredNorm(), there = p_Vc.squaredNorm();
  if (!(here < kMaxScale * kMaxScale * there && there < kMaxScale * kMaxScale * here)) return false;
  if (!(ray.dot(p_Vc) > std::cos(kMaxAngle) * std::sqrt(here * there))) return false;
  const auto pixel = left.model.project(p_Vc);
  return pixel && left.model.inImage(*pixel, kBorderPx);
}

std::optional<ViewQuery> predictInView(const StereoInertialCalibration& calibration,
                                       const OldView& view, const SeenLandmark& landmark,
                                       double sigma_px) {
  if (!isInView(calibration, view.T_NV, landmark)) return std::nullopt;
  const CameraCalibration& left = calibration.cameras[0];
  const SE3 T_VN = view.T_NV.inverse();
  const SE3 T_VcNc = left.T_BC.inverse() * T_VN * left.T_BC;
  const Eigen::Vector3d p_Nc = left.T_BC.inverse() * landmark.p_N;
  const Eigen::Vector2d pixel = *left.model.project(T_VcNc * p_Nc);
  const auto A = warp(left.model, T_VcNc, landmark.pixel, p_Nc);
  if (!A || !(A->determinant() > 0.1)) return std::nullopt;
  const auto measurement = makeMeasurement(left.model, pixel, sigma_px);
  if (!measurement) return std::nullopt;
  const auto residual = residualOf(calibration, 0, view.T_NV, landmark, *measurement, 1.0);
  if (!residual) return std::nullopt;
  const Eigen::Matrix2d S = residual->S + residual->J * view.covariance * residual->J.transpose();
  ViewQuery query;
  query.id = landmark.id;
  query.pixel = landmark.pixel;
  query.left = pixel;
  query.A = *A;
  query.reach_px = 2.0 + 3.0 * sigma_px * std::sqrt(S.trace());
  const CameraCalibration& right = calibration.cameras[1];
  const auto right_pixel = right.model.project(right.T_BC.inverse() * (T_VN * landmark.p_N));
  query.has_right = right_pixel && right.model.inImage(*right_pixel, kBorderPx);
  if (query.has_right) query.right = *right_pixel;
  return query;
}

std::optional<FoundLandmark> foundLandmark(const StereoInertialCalibration& calibration,
                                           size_t landmark, const ViewMatch& match,
                                           double sigma_px) {
  const auto left = makeMeasurement(calibration.cameras[0].model, match.left, sigma_px);
  if (!left) return std::nullopt;
  const auto right = makeMeasurement(calibration.cameras[1].model, match.right, sigma_px);
  FoundLandmark found;
  found.landmark = landmark;
  found.measurements[0] = *left;
  found.match = match;
  found.match.has_right = match.has_right && right;
  if (found.match.has_right) found.measurements[1] = *right;
  return found;
}

std::vector<FoundLandmark> agreeing(const StereoInertialCalibration& calibration,
                                    const OldView& view, const std::vector<SeenLandmark>& landmarks,
                                    const std::vector<FoundLandmark>& found, double pixel_variance,
                                    const MapOptions& options) {
  std::vector<FoundLandmark> gated;
  for (const FoundLandmark& f : found) {
    bool agrees = true;
    for (size_t camera = 0; camera < (f.match.has_right ? 2u : 1u); ++camera) {
      const auto at = residualOf(calibration, camera, view.T_NV, landmarks[f.landmark],
                                 f.measurements[camera], pixel_variance);
      agrees = agrees && at &&
               at->r.dot((at->S + at->J * view.covariance * at->J.transpose()).inverse() * at->r) <
                   options.chi2_gate;
    }
    if (agrees) gated.push_back(f);
  }
  // The view's pose by the other matches.
  const auto [d, H] = align(calibration, view, landmarks, gated, pixel_variance);
  std::vector<FoundLandmark> inliers;
  for (const FoundLandmark& f : gated) {
    bool agrees = true;
    for (size_t camera = 0; camera < (f.match.has_right ? 2u : 1u); ++camera) {
      const auto at = residualOf(calibration, camera, moved(view.T_NV, d), landmarks[f.landmark],
                                 f.measurements[camera], pixel_variance);
      agrees = agrees && at && at->r.dot(at->S.inverse() * at->r) < options.chi2_gate;
    }
    if (agrees) inliers.push_back(f);
  }
  constexpr double kChi2Pose = 22.46;  // 6 degrees of freedom, 99.9 %
  if (inliers.size() < static_cast<size_t>(options.min_landmarks) ||
      2 * inliers.size() < found.size() || squaredMahalanobis(d, view.covariance) > kChi2Pose)
    inliers.clear();
  return inliers;
}

OldView aligned(const StereoInertialCalibration& calibration, const OldView& view,
                const std::vector<SeenLandmark>& landmarks, const std::vector<FoundLandmark>& found,
                double pixel_variance) {
  const Alignment at = align(calibration, view, landmarks, found, pixel_variance);
  return {moved(view.T_NV, at.d), at.information.llt().solve(Matrix6d::Identity())};
}

}  // namespace etalon
