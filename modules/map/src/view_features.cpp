#include "view_features.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

namespace etalon {
namespace {

constexpr int kFeatures = 1000;
constexpr float kRatio = 0.8F;       // of the best match's distance to the second best's
constexpr double kCaution = 2.0;     // of the guess's standard deviations
constexpr double kFeaturePx = 2.0;   // standard deviation of a feature's pixel
constexpr double kEpipolarPx = 3.0;  // of a stereo match
constexpr double kInlierPx = 6.0;    // of RANSAC
constexpr size_t kMinInliers = 15;
constexpr double kNearest = 3.0;   // baselines
constexpr double kDistance = 1.6;  // standard deviation of a distance, as a share of it

Eigen::Vector2d pixelOf(const cv::KeyPoint& keypoint) { return {keypoint.pt.x, keypoint.pt.y}; }

/** Matches whose descriptor is much nearer than any other; query and train are the rows. */
std::vector<cv::DMatch> clearMatches(const cv::Mat& query, const cv::Mat& train) {
  if (query.empty() || train.empty()) return {};  // the matcher throws without rows to look in
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(query, train, nearest, 2);
  std::vector<cv::DMatch> clear;
  for (const auto& pair : nearest)
    if (pair.size() == 2 && pair[0].distance < kRatio * pair[1].distance) clear.push_back(pair[0]);
  return clear;
}

}  // namespace

ImageFeatures detectFeatures(const cv::Mat& image) {
  constexpr int kLevels = 4;
  constexpr float kScale = 1.4F;
  constexpr int kPatch = 31;
  constexpr int kFastThreshold = 10;  // gray levels: half of OpenCV's, for dark images
  const auto orb = cv::ORB::create(kFeatures, kScale, kLevels, kPatch, 0, 2, cv::ORB::HARRIS_SCORE,
                                   kPatch, kFastThreshold);
  ImageFeatures features;
  orb->detectAndCompute(image, cv::noArray(), features.keypoints, features.descriptors);
  return features;
}

ViewFeatures triangulateFeatures(const StereoInertialCalibration& calibration,
                                 const cv::Mat& left_image, const cv::Mat& right_image) {
  ViewFeatures view;
  const ImageFeatures left = detectFeatures(left_image), right = detectFeatures(right_image);
  const CameraCalibration &c0 = calibration.cameras[0], &c1 = calibration.cameras[1];
  const SE3 T_C1C0 = calibration.rightFromLeft();
  const double focal = c1.model.focal().mean();
  for (const cv::DMatch& match : clearMatches(left.descriptors, right.descriptors)) {
    const Eigen::Vector2d pixel = pixelOf(left.keypoints[match.queryIdx]);
    const auto ray = c0.model.unproject(pixel);
    const auto direction = c1.model.measure(pixelOf(right.keypoints[match.trainIdx]));
    if (!ray || !direction) continue;
    // f1 x (f0 + inverse_depth t) = 0: across the epipolar line, and along it.
    const Eigen::Vector3d f0 = T_C1C0.R * *ray, f1 = direction->ray();
    const Eigen::Vector3d line = direction->R_MC * T_C1C0.t.cross(f0);
    if (std::abs(line.dot(direction->xy.homogeneous())) >
        kEpipolarPx / focal * line.head<2>().norm())
      continue;
    const Eigen::Vector3d a = f1.cross(T_C1C0.t), b = f1.cross(f0);
    const double inverse_depth = -a.dot(b) / a.squaredNorm();
    const double baseline = calibration.baseline(), sigma = kFeaturePx / focal;  // rad
    if (!(inverse_depth * baseline * kDistance > sigma &&
          inverse_depth * baseline * kNearest < 1.0))
      continue;
    const Eigen::Vector3d p_B = c0.T_BC * (*ray / inverse_depth);
    view.landmarks.push_back(seenLandmark(c0.T_BC, match.queryIdx, pixel, p_B,
                                          sigma * (p_B - c0.T_BC.t).norm() / baseline, sigma));
    view.descriptors.push_back(left.descriptors.row(match.queryIdx));
  }
  return view;
}

std::optional<OldView> viewByFeatures(const StereoInertialCalibration& calibration,
                                      const ViewFeatures& view, const ImageFeatures& current) {
  if (view.landmarks.empty() || current.keypoints.empty()) return std::nullopt;
  const CameraCalibration& left = calibration.cameras[0];
  std::vector<FoundLandmark> found;
  std::vector<cv::Point3d> p_P;  // in the body's frame of the view
  std::vector<cv::Point2d> xy;
  for (const cv::DMatch& match : clearMatches(view.descriptors, current.descriptors)) {
    FoundLandmark f;
    f.landmark = match.queryIdx;
    const Eigen::Vector2d pixel = pixelOf(current.keypoints[match.trainIdx]);
    const auto ray = left.model.unproject(pixel);
    const auto measurement = makeMeasurement(left.model, pixel, kFeaturePx);
    if (!ray || !measurement || ray->z() <= 0.0) continue;
    f.measurements[0] = *measurement;
    found.push_back(f);
    const Eigen::Vector3d& p = view.landmarks[f.landmark].p_N;
    p_P.emplace_back(p.x(), p.y(), p.z());
    xy.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  if (found.size() < kMinInliers) return std::nullopt;
  constexpr int kTries = 200;
  constexpr double kConfidence = 0.999;
  cv::Mat turn, shift;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(p_P, xy, cv::Matx33d::eye(), cv::noArray(), turn, shift, false, kTries,
                          static_cast<float>(kInlierPx / left.model.focal().mean()), kConfidence,
                          inliers, cv::SOLVEPNP_P3P) ||
      inliers.size() < kMinInliers)
    return std::nullopt;
  cv::Matx33d R;
  cv::Rodrigues(turn, R);
  SE3 T_CP;  // the current left camera
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T_CP.R(i, j) = R(i, j);
    T_CP.t[i] = shift.at<double>(i);
  }
  OldView guess;  // here the current frame is the view
  guess.T_NV = (left.T_BC * T_CP).inverse();
  guess.covariance.setIdentity();  // nothing is known
  std::vector<FoundLandmark> agreed;
  for (const int i : inliers) agreed.push_back(found[i]);
  guess = inverse(aligned(calibration, guess, view.landmarks, agreed, 1.0));
  guess.covariance *= kCaution * kCaution;
  return guess;
}

}  // namespace etalon
