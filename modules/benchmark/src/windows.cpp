#include "etalon/benchmark/windows.h"

#include <algorithm>
#include <cmath>

#include "etalon/benchmark/summary.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/frontend/keyframe_selector.h"

namespace etalon {

std::vector<WindowShape> shapesOf(const BenchmarkProtocol& protocol) {
  std::vector<WindowShape> shapes;
  for (const int keyframes : protocol.keyframes)
    for (const double rate_hz : protocol.rates_hz) shapes.push_back({keyframes, rate_hz});
  return shapes;
}

void checkLength(const std::string& name, TimeNs first_image, TimeNs last_image) {
  const double duration_s = secondsBetween(first_image, last_image);
  if (duration_s <= kLongestRecordingS) return;
  throw DataError(name, 0,
                  "the images are " + std::to_string(std::llround(duration_s / 86'400.0)) +
                      " days apart; expected at most 7 days, is a stamp damaged?");
}

double shortestRecording(const WindowShape& shape) {
  return (shape.keyframes - 1 - 0.5) / shape.rate_hz;
}

std::vector<std::string> tooShort(const BenchmarkRecord& record, const WindowShape& shape) {
  std::vector<std::string> sentences;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const bool has_windows =
        std::any_of(record.results.begin(), record.results.end(), [&](const WindowResult& result) {
          return result.sequence == sequence.name && result.keyframes == shape.keyframes &&
                 result.rate_hz == shape.rate_hz;
        });
    if (has_windows || !sequence.error.empty() ||
        windowCount(sequence.first_image, sequence.last_image, record.protocol.every_s, shape) > 0)
      continue;
    const std::string text =
        format(": too short for %d keyframes at %g Hz (needs %.2f s, has %.2f s): 0 windows",
               shape.keyframes, shape.rate_hz, shortestRecording(shape),
               secondsBetween(sequence.first_image, sequence.last_image));
    sentences.push_back(sequence.name + text);
  }
  return sentences;
}

std::vector<std::string> tooShort(const BenchmarkRecord& record) {
  std::vector<WindowShape> shapes = shapesOf(record.protocol);
  for (const auto& [keyframes, rate_hz] : shapesOf(record))
    if (std::none_of(shapes.begin(), shapes.end(),
                     [k = keyframes, r = rate_hz](const WindowShape& known) {
                       return known.keyframes == k && known.rate_hz == r;
                     }))
      shapes.push_back({keyframes, rate_hz});
  std::vector<std::string> sentences;
  for (const WindowShape& shape : shapes)
    for (const std::string& sentence : tooShort(record, shape)) sentences.push_back(sentence);
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
  constexpr double kJitter = 1.05;  // 30 Hz may be asked of a camera of 29.97 Hz
  for (const double rate_hz : rates_hz) {
    if (camera_hz <= 0.0 || rate_hz <= kJitter * camera_hz) continue;
    throw ConfigError(format("%g keyframes a second: the camera of '", rate_hz) + recording +
                      format("' has %.1f images a second; expected a rate up to that", camera_hz));
  }
}

int windowCount(TimeNs first_image, TimeNs last_image, double every_s, const WindowShape& shape) {
  const double duration_s = secondsBetween(first_image, last_image);
  const double window_s = shortestRecording(shape);
  return duration_s < window_s
             ? 0
             : 1 + static_cast<int>(std::floor((duration_s - window_s) / every_s));
}

InitializationProblem windowProblem(const SequenceTracks& tracks, double every_s,
                                    const WindowShape& shape, int window,
                                    const ImuNoiseOptions& noise, const WindowOptions& options) {
  // A stamp's jitter must not move a window by a frame.
  constexpr double kJitter_s = 0.002;
  const TimeNs start = tracks.first_image + durationNs(std::max(0.0, window * every_s - kJitter_s));
  auto first = std::lower_bound(tracks.frames.begin(), tracks.frames.end(), start,
                                [](const TrackedFrame& frame, TimeNs t) { return frame.t < t; });
  // Windows that begin in a gap of the images would all be the one behind it.
  if (first != tracks.frames.end() && secondsBetween(start, first->t) >= 1.0 / shape.rate_hz)
    first = tracks.frames.end();
  KeyframeSelector selector(KeyframeSelectorOptions{shape.rate_hz});
  std::vector<TrackedFrame> frames;
  std::vector<int> keyframes;
  for (auto frame = first;
       frame != tracks.frames.end() && static_cast<int>(keyframes.size()) < shape.keyframes;
       ++frame) {
    frames.push_back(*frame);
    if (selector.isKeyframe(frame->t)) keyframes.push_back(static_cast<int>(frames.size()) - 1);
  }
  if (!keyframes.empty()) frames.resize(keyframes.back() + 1);
  ImuBuffer imu;
  if (keyframes.size() > 1) imu = ImuBuffer(tracks.imu.between(frames.front().t, frames.back().t));
  const ImuNoiseDensities densities = noise.apply(tracks.calibration.imu.noise, imu.samples());
  return makeProblem(tracks.calibration, densities, options, std::move(frames),
                     std::move(keyframes), std::move(imu));
}

}  // namespace etalon
