#include "trial/trial_flight.h"

#include <algorithm>
#include <utility>

#include "etalon/core/statistics.h"

namespace etalon {

namespace {

/** Why the last attempt was refused; at the end of the IMU an attempt says nothing but that. */
std::string refusalOf(const std::vector<InitializationAttempt>& attempts) {
  std::string reason;
  for (auto attempt = attempts.rbegin(); attempt != attempts.rend(); ++attempt) {
    if (attempt->accepted()) continue;
    const Refusal& refusal = attempt->decision.error();
    if (reason.empty() || refusal.status != RefusalStatus::kImuGap) reason = refusal.reason;
    if (refusal.status != RefusalStatus::kImuGap) break;
  }
  return reason;
}

}  // namespace

void TrialFlight::feed(SensorEvent event) {
  if (const auto* sample = std::get_if<ImuSample>(&event)) {
    pipeline_.add(*sample);
    return;
  }
  auto& frame = std::get<StereoFrame>(event);
  images_.push_back(frame.t);
  pipeline_.add(std::move(frame));
}

Flown TrialFlight::finish() {
  pipeline_.finish();
  Flown flown;
  flown.images = images_;
  flown.started = pipeline_.initializedAt();
  flown.causal = pipeline_.trajectory();
  flown.smoothed = pipeline_.smoothedTrajectory();
  flown.estimates = pipeline_.estimates();
  flown.events = pipeline_.events();
  flown.end_state = toString(pipeline_.state());
  flown.refusal = refusalOf(pipeline_.attempts());
  std::vector<double> ms;
  for (const FrameTiming& timing : pipeline_.timings())
    ms.push_back(timing.frontend_ms + timing.odometry_ms);
  flown.frame_ms = median(std::move(ms));
  return flown;
}

Flown flownBySystem(const Trajectory& trajectory, const std::vector<TimeNs>& images,
                    const std::optional<TimeNs>& fault_at) {
  Flown flown;
  flown.images = images;
  flown.fault_at = fault_at;
  std::vector<double> steps;
  for (size_t i = 1; i < images.size(); ++i)
    steps.push_back(secondsBetween(images[i - 1], images[i]));
  const TimeNs half = images.size() > 1 ? durationNs(0.5 * median(std::move(steps))) : 0;
  auto pose = trajectory.begin();
  for (const TimeNs image : images) {
    while (pose != trajectory.end() && pose->t < image - half) ++pose;
    if (pose == trajectory.end() || pose->t > image + half) continue;
    auto nearest = pose;
    for (auto next = pose; next != trajectory.end() && next->t <= image + half; ++next)
      if (std::llabs(next->t - image) < std::llabs(nearest->t - image)) nearest = next;
    flown.causal.push_back(*nearest);
    pose = nearest + 1;
  }
  if (!flown.causal.empty())
    flown.started = flown.causal.front().t;
  else if (!trajectory.empty())
    flown.refusal = "none of its " + std::to_string(trajectory.size()) +
                    " poses lies within half a frame of an image; is it on the same clock?";
  return flown;
}

}  // namespace etalon
