#include "etalon/map/image_views.h"

#include <Eigen/LU>
#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "etalon/frontend/image_content.h"
#include "view_features.h"

namespace etalon {
namespace {

constexpr int kPatchSide = 17;  // px, at every level
constexpr int kIterations = 15;
constexpr double kEpsilonPx = 0.01;
constexpr double kReachPx = 3.0;  // of an alignment, at its level
constexpr double kMinCorrelation = 0.85;
constexpr double kMaxScaleError = 1.6;  // of the area against the prediction's

}  // namespace

void ImageViews::show(const cv::Mat& left, const cv::Mat& right) {
  current_.left[0] = left;
  for (size_t level = 1; level < kLevels; ++level) current_.left[level] = cv::Mat();
  current_.right = right;
  patches_.clear();
  current_features_.reset();
}

const AnchorPatch& ImageViews::patchOf(const ViewQuery& query, size_t level) {
  const auto [entry, is_new] = patches_.try_emplace({query.id, level});
  if (is_new)
    entry->second = AnchorPatch(current_.left[level], query.pixel / (1 << level), kPatchSide);
  return entry->second;
}

bool ImageViews::keep(TimeNs view) {
  if (current_.left[0].empty() || withoutContrast(current_.left[0])) return false;
  View kept;
  kept.left[0] = current_.left[0].clone();
  for (size_t level = 1; level < kLevels; ++level)
    cv::pyrDown(kept.left[level - 1], kept.left[level]);
  kept.right = current_.right.clone();
  views_[view] = std::move(kept);
  return true;
}

void ImageViews::dropAllBut(const std::vector<TimeNs>& views) {
  const auto has = [](const std::vector<TimeNs>& stamps, TimeNs t) {
    return std::binary_search(stamps.begin(), stamps.end(), t);
  };
  for (auto it = views_.begin(); it != views_.end();)
    it = has(views, it->first) || has(pinned_, it->first) ? std::next(it) : views_.erase(it);
}

bool ImageViews::prepare(TimeNs view) {
  const auto known = views_.find(view);
  if (known == views_.end() || known->second.features) return false;
  View& of = known->second;
  of.features =
      std::make_shared<const ViewFeatures>(triangulateFeatures(calibration_, of.left[0], of.right));
  return true;
}

std::optional<OldView> ImageViews::recognize(TimeNs view) {
  const auto known = views_.find(view);
  if (known == views_.end() || !known->second.features || current_.left[0].empty())
    return std::nullopt;
  if (!current_features_)
    current_features_ = std::make_shared<const ImageFeatures>(detectFeatures(current_.left[0]));
  return viewByFeatures(calibration_, *known->second.features, *current_features_);
}

std::vector<ViewMatch> ImageViews::find(TimeNs view, const std::vector<ViewQuery>& queries) {
  std::vector<ViewMatch> matches(queries.size());
  const auto known = views_.find(view);
  if (known == views_.end() || current_.left[0].empty()) return matches;
  for (size_t level = 1; level < kLevels; ++level)
    if (current_.left[level].empty()) cv::pyrDown(current_.left[level - 1], current_.left[level]);
  for (size_t i = 0; i < queries.size(); ++i) matches[i] = find(known->second, queries[i]);
  return matches;
}

ViewMatch ImageViews::find(const View& view, const ViewQuery& query) {
  ViewMatch match;
  PatchPose pose{query.left, query.A};
  int level = 0;
  while (level + 1 < kLevels && query.reach_px > kReachPx * (1 << level)) ++level;
  double correlation = -1.0;
  for (; level >= 0; --level) {
    const AnchorPatch& patch = patchOf(query, level);
    if (!patch.valid()) return match;
    const double scale = 1.0 / (1 << level);
    PatchPose at{scale * pose.centre, pose.A};
    correlation = patch.align(view.left[level], &at, kIterations, kEpsilonPx);
    if (correlation < 0.0) return match;
    pose = {at.centre / scale, at.A};
  }
  const double scale_error = pose.A.determinant() / query.A.determinant();
  if (correlation < kMinCorrelation || (pose.centre - query.left).norm() > query.reach_px ||
      !(scale_error < kMaxScaleError && scale_error > 1.0 / kMaxScaleError))
    return match;
  match.found = true;
  match.left = pose.centre;
  if (!query.has_right) return match;
  const Eigen::Vector2d guess = query.right + (pose.centre - query.left);
  PatchPose right{guess, pose.A};
  match.has_right =
      patchOf(query, 0).align(view.right, &right, kIterations, kEpsilonPx) >= kMinCorrelation &&
      (right.centre - guess).norm() <= kReachPx;
  match.right = right.centre;
  return match;
}

}  // namespace etalon
