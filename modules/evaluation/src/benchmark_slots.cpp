#include "etalon/evaluation/benchmark_slots.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/frontend/keyframe_selector.h"

namespace etalon {

std::vector<BenchmarkWindow> windowsOf(const BenchmarkProtocol& protocol) {
  std::vector<BenchmarkWindow> windows;
  for (const int keyframes : protocol.keyframes)
    for (const double rate_hz : protocol.rates_hz) windows.push_back({keyframes, rate_hz});
  return windows;
}

void checkLength(const std::string& name, TimeNs first_image, TimeNs last_image) {
  const double duration_s = secondsBetween(first_image, last_image);
  if (duration_s <= kLongestRecordingS) return;
  throw DataError(name, 0,
                  "the images are " + std::to_string(std::llround(duration_s / 86'400.0)) +
                      " days apart; expected at most 7 days, is a stamp damaged?");
}

int slotCount(TimeNs first_image, TimeNs last_image, double every_s,
              const BenchmarkWindow& window) {
  const double duration_s = secondsBetween(first_image, last_image);
  const double window_s = (window.keyframes - 1 - 0.5) / window.rate_hz;
  return duration_s < window_s
             ? 0
             : 1 + static_cast<int>(std::floor((duration_s - window_s) / every_s));
}

InitializationProblem slotProblem(const SequenceTracks& tracks, double every_s,
                                  const BenchmarkWindow& window, int segment,
                                  const ImuNoiseDensities& noise, const WindowOptions& options) {
  // A stamp's jitter must not move a slot by a frame.
  constexpr double kJitter_s = 0.002;
  const TimeNs start =
      tracks.first_image + durationNs(std::max(0.0, segment * every_s - kJitter_s));
  auto first = std::lower_bound(tracks.frames.begin(), tracks.frames.end(), start,
                                [](const TrackedFrame& frame, TimeNs t) { return frame.t < t; });
  KeyframeSelector selector(KeyframeSelectorOptions{window.rate_hz});
  std::vector<TrackedFrame> frames;
  std::vector<int> keyframes;
  for (auto frame = first;
       frame != tracks.frames.end() && static_cast<int>(keyframes.size()) < window.keyframes;
       ++frame) {
    frames.push_back(*frame);
    if (selector.isKeyframe(frame->t)) keyframes.push_back(static_cast<int>(frames.size()) - 1);
  }
  if (!keyframes.empty()) frames.resize(static_cast<size_t>(keyframes.back()) + 1);
  ImuBuffer imu;
  if (keyframes.size() > 1) imu = ImuBuffer(tracks.imu.between(frames.front().t, frames.back().t));
  return makeProblem(tracks.calibration, noise, options, std::move(frames), std::move(keyframes),
                     std::move(imu));
}

}  // namespace etalon
