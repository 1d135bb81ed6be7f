#include "etalon/map/place_search.h"

#include <algorithm>
#include <numeric>

#include "etalon/core/so3.h"
#include "etalon/map/view_search.h"
#include "etalon/map/view_selection.h"

namespace etalon {
namespace {

constexpr size_t kPlacesALook = 2;

}  // namespace

PlaceSearch::PlaceSearch(const StereoInertialCalibration& calibration, const MapOptions& options,
                         double sigma_px, std::shared_ptr<ImageViews> views)
    : calibration_(calibration), options_(options), sigma_px_(sigma_px), views_(std::move(views)) {}

void PlaceSearch::remember(const Trajectory& keyframes) {
  for (const StampedPose& keyframe : keyframes)
    if (views_->has(keyframe.t)) places_[keyframe.t] = keyframe.T_WB;
  while (places_.size() > static_cast<size_t>(options_.max_keyframes)) {
    std::vector<SE3> T_WC;
    for (const auto& [t, T_WB] : places_) T_WC.push_back(T_WB * calibration_.cameras[0].T_BC);
    places_.erase(std::next(places_.begin(), redundantView(T_WC, options_)));
  }
  std::vector<TimeNs> pinned;
  for (const auto& [t, T_WB] : places_) pinned.push_back(t);
  views_->pin(pinned);
  next_ = 0;
}

void PlaceSearch::prepareOne() {
  for (auto place = places_.rbegin(); place != places_.rend(); ++place)
    if (views_->prepare(place->first)) return;
}

std::optional<Sighting> PlaceSearch::confirm(TimeNs place, const OldView& guess,
                                             const std::vector<SeenLandmark>& landmarks) const {
  std::vector<size_t> all(landmarks.size());
  std::iota(all.begin(), all.end(), 0);
  ViewFindings found = ViewSearch{calibration_, options_, sigma_px_, 1.0, *views_}.find(
      place, guess, landmarks, all);
  if (!found.confirmGuess()) return std::nullopt;
  return Sighting{place, places_.at(place),
                  aligned(calibration_, guess, landmarks, found.landmarks, 1.0),
                  std::move(found.observations)};
}

std::optional<Sighting> PlaceSearch::look(const std::vector<SeenLandmark>& landmarks) {
  for (size_t i = 0; i < std::min(kPlacesALook, places_.size()); ++i) {
    next_ = next_ % places_.size() + 1;
    const TimeNs t = std::prev(places_.end(), static_cast<std::ptrdiff_t>(next_))->first;
    const auto guess = views_->recognize(t);
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
  size_t most = ViewFindings::kMinLandmarks - 1;
  for (const auto& [t, T_WV] : places_) {
    const SE3 T_NV = T_WN.inverse() * T_WV;
    const auto shown = static_cast<size_t>(
        std::count_if(landmarks.begin(), landmarks.end(),
                      [&](const SeenLandmark& l) { return isInView(calibration_, T_NV, l); }));
    if (shown <= most) continue;
    best = t;
    most = shown;
    view.T_NV = T_NV;
  }
  if (most < ViewFindings::kMinLandmarks) return std::nullopt;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.topLeftCorner<3, 3>() = -view.T_NV.R.transpose();
  J.bottomLeftCorner<3, 3>() = hat(view.T_NV.t);
  J.bottomRightCorner<3, 3>() = -T_WN.R.transpose();
  view.covariance = J * covariance * J.transpose();
  return confirm(best, view, landmarks);
}

}  // namespace etalon
