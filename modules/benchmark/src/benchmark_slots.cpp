#include "etalon/benchmark/benchmark_slots.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "etalon/benchmark/benchmark_summary.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
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

double shortestRecording(const BenchmarkWindow& window) {
  return (window.keyframes - 1 - 0.5) / window.rate_hz;
}

std::vector<std::string> tooShort(const BenchmarkRecord& record, const BenchmarkWindow& window) {
  std::vector<std::string> sentences;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const bool has_slots =
        std::any_of(record.slots.begin(), record.slots.end(), [&](const SlotRecord& slot) {
          return slot.sequence == sequence.name && slot.keyframes == window.keyframes &&
                 slot.rate_hz == window.rate_hz;
        });
    if (has_slots || !sequence.error.empty() ||
        slotCount(sequence.first_image, sequence.last_image, record.protocol.every_s, window) > 0)
      continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  ": too short for %d keyframes at %g Hz (needs %.2f s, has %.2f s): 0 slots",
                  window.keyframes, window.rate_hz, shortestRecording(window),
                  secondsBetween(sequence.first_image, sequence.last_image));
    sentences.push_back(sequence.name + text);
  }
  return sentences;
}

std::vector<std::string> tooShort(const BenchmarkRecord& record) {
  std::vector<BenchmarkWindow> windows = windowsOf(record.protocol);
  for (const auto& [keyframes, rate_hz] : windowsOf(record))
    if (std::none_of(windows.begin(), windows.end(),
                     [k = keyframes, r = rate_hz](const BenchmarkWindow& known) {
                       return known.keyframes == k && known.rate_hz == r;
                     }))
      windows.push_back({keyframes, rate_hz});
  std::vector<std::string> sentences;
  for (const BenchmarkWindow& window : windows)
    for (const std::string& sentence : tooShort(record, window)) sentences.push_back(sentence);
  return sentences;
}

double imageRate(const std::vector<TimeNs>& stamps) {
  if (stamps.size() < 2) return 0.0;
  std::vector<double> intervals;
  for (size_t i = 1; i < stamps.size(); ++i)
    intervals.push_back(secondsBetween(stamps[i - 1], stamps[i]));
  const double median = quantile(std::move(intervals), 0.5);
  return median > 0.0 ? 1.0 / median : 0.0;
}

void checkKeyframeRates(const std::vector<double>& rates_hz, double camera_hz,
                        const std::string& recording) {
  constexpr double kJitter = 1.05;  // a camera of 29.97 Hz may be asked for 30
  for (const double rate_hz : rates_hz) {
    if (camera_hz <= 0.0 || rate_hz <= kJitter * camera_hz) continue;
    char text[120];
    std::snprintf(text, sizeof text, "%g keyframes a second: the camera of '", rate_hz);
    std::string message = text + recording;
    std::snprintf(text, sizeof text, "' has %.1f images a second; expected a rate up to that",
                  camera_hz);
    throw ConfigError(message + text);
  }
}

int slotCount(TimeNs first_image, TimeNs last_image, double every_s,
              const BenchmarkWindow& window) {
  const double duration_s = secondsBetween(first_image, last_image);
  const double window_s = shortestRecording(window);
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
