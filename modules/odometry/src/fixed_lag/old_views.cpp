#include "old_views.h"

#include <algorithm>

namespace etalon::fixed_lag {
namespace {

constexpr double kBlindS = 1.0;  ///< without images: patches may be too far from their predictions
constexpr double kLookS = 20.0;  ///< for old keyframes after that

}  // namespace

OldViews::OldViews(const StereoInertialCalibration& calibration, const MapOptions& options,
                   double sigma_px, std::shared_ptr<ViewMatcher> matcher)
    : recall_(calibration, options, sigma_px), options_(options), matcher_(std::move(matcher)) {
  options_.enabled = options_.enabled && matcher_;
}

void OldViews::begin(Window* window) {
  blind_.clear();
  if (!options_.enabled) return;
  matcher_->dropAllBut({});
  WindowState& first = window->states.front();
  first.is_view = matcher_->keep(first.t);
}

void OldViews::find(const TrackedFrame& frame, const WindowSolver& solver, Window* window,
                    OdometryOutput* out) {
  out->recalled = recall_.recall(frame, matcher_.get(), solver, window);
  if (options_.relocalize) recognize(frame, solver, window, out);
}

void OldViews::recognize(const TrackedFrame& frame, const WindowSolver& solver, Window* window,
                         OdometryOutput* out) {
  const auto isOver = [&](const Blind& blind) {
    return secondsBetween(blind.until, frame.t) > kLookS ||
           std::any_of(out->recalled.begin(), out->recalled.end(),
                       [&](const auto& r) { return r.keyframe <= blind.after; });
  };
  blind_.erase(std::remove_if(blind_.begin(), blind_.end(), isOver), blind_.end());
  if (blind_.empty()) return;
  std::vector<TimeNs> after;
  for (const Blind& blind : blind_) after.push_back(blind.after);
  out->recognition =
      recall_.recognize(frame, after, matcher_.get(), solver, window, &out->recalled);
  if (out->recognition)
    blind_.erase(std::find_if(blind_.begin(), blind_.end(),
                              [&](const Blind& b) { return b.after == out->recognition->after; }),
                 blind_.end());
}

void OldViews::located(TimeNs before, TimeNs now) {
  if (secondsBetween(before, now) > kBlindS) blind_.push_back({before, now});
}

void OldViews::prepare(const Window& window, TimeNs located_at) {
  if (!options_.enabled || !options_.relocalize) return;
  const bool is_blind = secondsBetween(located_at, window.states.back().t) > kBlindS;
  if (!is_blind && blind_.empty()) return;
  const TimeNs after = is_blind ? located_at : blind_.back().after;
  for (auto state = window.states.rbegin(); state != window.states.rend(); ++state)
    if (state->is_view && state->t <= after && matcher_->prepare(state->t)) return;
}

void OldViews::keepNewest(Window* window) {
  WindowState& newest = window->states.back();
  newest.is_view = newest.keyframe && options_.enabled && matcher_->keep(newest.t);
}

void OldViews::dropGone(const Window& window) {
  if (!options_.enabled) return;
  std::vector<TimeNs> stamps;
  for (const WindowState& state : window.states)
    if (state.keyframe) stamps.push_back(state.t);
  matcher_->dropAllBut(stamps);
}

}  // namespace etalon::fixed_lag
