#include "etalon/map/place_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "etalon/core/so3.h"
#include "etalon/map/view_selection.h"

namespace etalon {
namespace {

constexpr int kFeatures = 1000;
constexpr size_t kPlacesALook = 2;
constexpr float kRatio = 0.8F;       // of the best match's distance to the second best's
constexpr double kCaution = 2.0;     // of the guess's standard deviations
constexpr double kFeaturePx = 2.0;   // standard deviation of a feature's pixel
constexpr double kEpipolarPx = 3.0;  // of a stereo match
constexpr double kInlierPx = 6.0;    // of RANSAC
constexpr size_t kMinInliers = 15;
// Scenes repeat themselves: where a guess is wrong, a tenth of the landmarks seem to agree.
constexpr size_t kMinLandmarks = 20;
constexpr double kMinShare = 0.3;                   // of those that the place should show
constexpr double kNearest = 0.3, kFarthest = 40.0;  // m

Eigen::Vector2d pixelOf(const cv::KeyPoint& keypoint) { return {keypoint.pt.x, keypoint.pt.y}; }

struct Features {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;  ///< a row each
};

Features detect(const cv::Mat& image) {
  constexpr int kLevels = 4;
  constexpr float kScale = 1.4F;
  constexpr int kPatch = 31;
  constexpr int kFastThreshold = 10;  // gray levels: half of OpenCV's, for dark images
  const auto orb = cv::ORB::create(kFeatures, kScale, kLevels, kPatch, 0, 2, cv::ORB::HARRIS_SCORE,
                                   kPatch, kFastThreshold);
  Features features;
  orb->detectAndCompute(image, cv::noArray(), features.keypoints, features.descriptors);
  return features;
}

/** Matches whose descriptor is much nearer than any other; query and train are the rows. */
std::vector<cv::DMatch> clearMatches(const cv::Mat& query, const cv::Mat& train) {
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(query, train, nearest, 2);
  std::vector<cv::DMatch> clear;
  for (const auto& pair : nearest)
    if (pair.size() == 2 && pair[0].distance < kRatio * pair[1].distance) clear.push_back(pair[0]);
  return clear;
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

PlaceSearch::PlaceSearch(const StereoInertialCalibration& calibration, const MapOptions& options,
                         double sigma_px, std::shared_ptr<ImageViews> views)
    : calibration_(calibration), options_(options), sigma_px_(sigma_px), views_(std::move(views)) {}

void PlaceSearch::remember(const Trajectory& keyframes) {
  for (const StampedPose& keyframe : keyframes)
    if (!views_->imagesOf(keyframe.t)[0].empty()) places_[keyframe.t].T_WB = keyframe.T_WB;
  while (places_.size() > static_cast<size_t>(options_.max_keyframes)) {
    std::vector<SE3> T_WC;
    for (const auto& [t, place] : places_)
      T_WC.push_back(place.T_WB * calibration_.cameras[0].T_BC);
    places_.erase(std::next(places_.begin(), redundantView(T_WC, options_)));
  }
  std::vector<TimeNs> pinned;
  for (const auto& [t, place] : places_) pinned.push_back(t);
  views_->pin(pinned);
  next_ = 0;
}

void PlaceSearch::prepareOne() {
  const auto place = std::find_if(places_.rbegin(), places_.rend(),
                                  [](const auto& entry) { return !entry.second.prepared; });
  if (place != places_.rend()) prepare(place->first, &place->second);
}

void PlaceSearch::prepare(TimeNs t, Place* place) const {
  place->prepared = true;
  const auto images = views_->imagesOf(t);
  const Features left = detect(images[0]), right = detect(images[1]);
  const CameraCalibration &c0 = calibration_.cameras[0], &c1 = calibration_.cameras[1];
  const SE3 T_C1C0 = calibration_.rightFromLeft();
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
    if (!(inverse_depth > 1.0 / kFarthest && inverse_depth < 1.0 / kNearest)) continue;
    const double sigma = kFeaturePx / focal;  // rad
    const Eigen::Vector3d p_B = c0.T_BC * (*ray / inverse_depth);
    place->landmarks.push_back(
        seenLandmark(c0.T_BC, match.queryIdx, pixel, p_B,
                     sigma * (p_B - c0.T_BC.t).norm() / calibration_.baseline(), sigma));
    place->descriptors.push_back(left.descriptors.row(match.queryIdx));
  }
}

std::optional<OldView> PlaceSearch::firstGuess(const Place& place,
                                               const std::vector<cv::KeyPoint>& keypoints,
                                               const cv::Mat& descriptors) const {
  const CameraCalibration& left = calibration_.cameras[0];
  std::vector<FoundLandmark> found;
  std::vector<cv::Point3d> p_P;  // in the body's frame at the place
  std::vector<cv::Point2d> xy;
  for (const cv::DMatch& match : clearMatches(place.descriptors, descriptors)) {
    FoundLandmark f;
    f.landmark = match.queryIdx;
    const Eigen::Vector2d pixel = pixelOf(keypoints[match.trainIdx]);
    const auto ray = left.model.unproject(pixel);
    const auto measurement = makeMeasurement(left.model, pixel, kFeaturePx);
    if (!ray || !measurement || ray->z() <= 0.0) continue;
    f.measurements[0] = *measurement;
    found.push_back(f);
    const Eigen::Vector3d& p = place.landmarks[f.landmark].p_N;
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
  guess = inverse(aligned(calibration_, guess, place.landmarks, agreed, 1.0));
  guess.covariance *= kCaution * kCaution;
  return guess;
}

std::optional<Sighting> PlaceSearch::confirm(TimeNs place, const OldView& guess,
                                             const std::vector<SeenLandmark>& landmarks) const {
  std::vector<ViewQuery> queries;
  std::vector<size_t> asked;
  for (size_t l = 0; l < landmarks.size(); ++l)
    if (const auto query = predictInView(calibration_, guess, landmarks[l], sigma_px_)) {
      queries.push_back(*query);
      asked.push_back(l);
    }
  const std::vector<ViewMatch> matches = views_->find(place, queries);
  std::vector<FoundLandmark> found;
  std::map<size_t, const ViewMatch*> match_of;  // by the landmark's index
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i].found) continue;
    const auto f = foundLandmark(calibration_, asked[i], matches[i], sigma_px_);
    if (!f) continue;
    found.push_back(*f);
    match_of[asked[i]] = &matches[i];
  }
  const std::vector<FoundLandmark> believed =
      agreeing(calibration_, guess, landmarks, found, 1.0, options_);
  if (believed.size() < kMinLandmarks ||
      static_cast<double>(believed.size()) < kMinShare * static_cast<double>(queries.size()))
    return std::nullopt;
  Sighting sighting;
  sighting.place = place;
  sighting.T_WP = places_.at(place).T_WB;
  sighting.view = aligned(calibration_, guess, landmarks, believed, 1.0);
  for (const FoundLandmark& f : believed) {
    const ViewMatch& match = *match_of.at(f.landmark);
    sighting.observations.push_back(
        {landmarks[f.landmark].id, match.left, match.right, f.has_right});
  }
  return sighting;
}

std::optional<Sighting> PlaceSearch::look(const std::vector<SeenLandmark>& landmarks) {
  if (places_.empty() || views_->left().empty()) return std::nullopt;
  const Features now = detect(views_->left());
  if (now.keypoints.empty()) return std::nullopt;
  for (size_t i = 0; i < std::min(kPlacesALook, places_.size()); ++i) {
    next_ = next_ % places_.size() + 1;
    const auto& [t, place] = *std::prev(places_.end(), static_cast<std::ptrdiff_t>(next_));
    if (place.landmarks.empty()) continue;
    const auto guess = firstGuess(place, now.keypoints, now.descriptors);
    if (!guess) continue;
    if (auto sighting = confirm(t, *guess, landmarks)) return sighting;
  }
  return std::nullopt;
}

std::optional<Sighting> PlaceSearch::lookNear(const SE3& T_WN,
                                              const Eigen::Matrix<double, 6, 6>& covariance,
                                              const std::vector<SeenLandmark>& landmarks) const {
  TimeNs best = 0;
  OldView view;
  size_t most = kMinLandmarks - 1;
  for (const auto& [t, place] : places_) {
    const SE3 T_NV = T_WN.inverse() * place.T_WB;
    const auto shown = static_cast<size_t>(
        std::count_if(landmarks.begin(), landmarks.end(),
                      [&](const SeenLandmark& l) { return isInView(calibration_, T_NV, l); }));
    if (shown <= most) continue;
    best = t;
    most = shown;
    view.T_NV = T_NV;
  }
  if (most < kMinLandmarks) return std::nullopt;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.topLeftCorner<3, 3>() = -view.T_NV.R.transpose();
  J.bottomLeftCorner<3, 3>() = hat(view.T_NV.t);
  J.bottomRightCorner<3, 3>() = -T_WN.R.transpose();
  view.covariance = J * covariance * J.transpose();
  return confirm(best, view, landmarks);
}

}  // namespace etalon
