#include "window_trial.h"

#include <algorithm>

#include "etalon/benchmark/windows.h"
#include "etalon/pipeline/nested_windows.h"
#include "etalon/runlog/attempt_record.h"

namespace etalon {

WindowTrial::WindowTrial(const WindowResult& result, const SequenceTracks& tracks,
                         const GroundTruthCheck& ground_truth_check,
                         const BenchmarkProtocol& protocol, const ImuNoiseOptions& noise,
                         const WindowOptions& options)
    : tracks_(tracks), ground_truth_check_(ground_truth_check), options_(options) {
  options_.check_noise = true;
  const int last = result.keyframes;
  const int first = protocol.min_keyframes > 0 ? std::min(protocol.min_keyframes, last) : last;
  for (int keyframes = first; keyframes <= last; ++keyframes)
    windows_.push_back(windowOf(result, keyframes, protocol.every_s, noise));
}

WindowTrial::Window WindowTrial::windowOf(const WindowResult& result, int keyframes, double every_s,
                                          const ImuNoiseOptions& noise) const {
  Window window{result, windowProblem(tracks_, every_s, {keyframes, result.rate_hz}, result.window,
                                      noise, options_)};
  WindowResult& before = window.before;
  std::vector<TimeNs>& stamps = before.attempt.keyframes;
  for (int k = 0; k < window.problem.keyframeCount(); ++k)
    stamps.push_back(window.problem.keyframe(k).t);
  before.gyro_bound = gyroWindowBound(tracks_.ground_truth, tracks_.imu, stamps);
  for (const TimeNs t : stamps)
    if (const auto state = tracks_.ground_truth.at(t)) before.truth.push_back(*state);
  if (!stamps.empty()) {
    before.t0 = stamps.front();
    before.attempt.t = stamps.back();
  }
  return window;
}

WindowResult WindowTrial::tryWith(const ConfiguredInitializer& initializer) const {
  InitializationAttempt attempt, earlier;
  const Window* window = nullptr;
  for (const Window& next : windows_) {
    earlier = std::move(attempt);
    attempt = attemptInitialization(next.problem, *initializer.initializer, options_);
    if (windows_.size() > 1) confirm(window ? &earlier : nullptr, options_.acceptance, &attempt);
    if (window) {
      attempt.initialize_ms += earlier.initialize_ms;
      attempt.stereo_odometry_ms += earlier.stereo_odometry_ms;
      attempt.vi_ba_ms += earlier.vi_ba_ms;
    }
    window = &next;
    if (attempt.accepted()) break;
  }
  WindowResult result = record(*window, attempt);
  result.initializer = initializer.plugin.name;
  return result;
}

WindowResult WindowTrial::record(const Window& window, const InitializationAttempt& attempt) const {
  WindowResult result = window.before;
  result.attempt = makeAttemptRecord(attempt, options_.gravity_mps2, tracks_.ground_truth,
                                     ground_truth_check_.foundGravityDirection());
  for (StageRecord& stage : result.attempt.stages) {
    stage.covariance.resize(0, 0);
    stage.covariance_order.clear();
  }
  if (attempt.has_vi_ba && attempt.vi_ba.noise.gyro.dof > 0.0) result.noise = attempt.vi_ba.noise;
  return result;
}

WindowResult WindowTrial::lost(const std::string& initializer, const std::string& status,
                               const std::string& how) const {
  WindowResult result = windows_.back().before;
  result.initializer = initializer;
  result.attempt.status = status;
  result.attempt.reason = how;
  return result;
}

}  // namespace etalon
