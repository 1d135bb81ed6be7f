#include "window_trial.h"

#include <algorithm>

#include "etalon/benchmark/windows.h"
#include "etalon/pipeline/starter.h"
#include "etalon/runlog/attempt_record.h"

namespace etalon {

WindowTrial::WindowTrial(const WindowResult& result, const SequenceTracks& tracks,
                         const GroundTruthCheck& ground_truth_check,
                         const BenchmarkProtocol& protocol, const ImuNoiseOptions& noise,
                         const WindowOptions& options)
    : shape_{result.keyframes, result.rate_hz},
      first_keyframes_(protocol.min_keyframes > 0 ? protocol.min_keyframes : shape_.keyframes),
      tracks_(tracks),
      ground_truth_check_(ground_truth_check),
      noise_(noise),
      options_(options),
      whole_(windowProblem(tracks, protocol.every_s, shape_, result.window, noise, options)),
      before_(result) {
  options_.check_noise = true;
  std::vector<TimeNs> stamps;
  for (int k = 0; k < whole_.keyframeCount(); ++k) stamps.push_back(whole_.keyframe(k).t);
  describe(stamps, &before_);
}

/** What is known of a window before an initializer has tried it. */
void WindowTrial::describe(const std::vector<TimeNs>& keyframes, WindowResult* result) const {
  result->attempt.keyframes = keyframes;
  result->truth_check =
      checkWindowTruth(tracks_.ground_truth, tracks_.imu, keyframes,
                       options_.gravity_mps2 * ground_truth_check_.gravity_direction_G);
  result->truth.clear();
  for (const TimeNs t : keyframes)
    if (const auto state = tracks_.ground_truth.at(t)) result->truth.push_back(*state);
  if (!keyframes.empty()) {
    result->t0 = keyframes.front();
    result->attempt.t = keyframes.back();
  }
}

WindowResult WindowTrial::tryWith(const ConfiguredInitializer& initializer) const {
  const bool grows = first_keyframes_ < shape_.keyframes;
  WindowResult result =
      record(grows ? grow(initializer)
                   : attemptInitialization(whole_, *initializer.initializer, options_));
  result.initializer = initializer.plugin.name;
  return result;
}

namespace {

void addTo(const StageTiming& timing, std::vector<StageTiming>* all) {
  const auto same = std::find_if(all->begin(), all->end(),
                                 [&](const StageTiming& t) { return t.stage == timing.stage; });
  if (same == all->end())
    all->push_back(timing);
  else
    same->milliseconds += timing.milliseconds;
}

}  // namespace

/** The last attempt, with the times of all. */
InitializationAttempt WindowTrial::grow(const ConfiguredInitializer& initializer) const {
  Starter starter({initializer.plugin.name, initializer.initializer, nullptr, ""}, {}, options_,
                  whole_.imuNoise(), true);
  KeyframeWindow window(shape_.keyframes, shape_.rate_hz);
  const auto problem = [&](const WindowOptions& options) { return problemOf(window, options); };
  for (const TrackedFrame& frame : whole_.frames()) {
    const bool keyframe = window.isKeyframe(frame.t);
    window.add(frame, keyframe);
    if (!keyframe || window.regularKeyframes() < first_keyframes_) continue;
    if (starter.attempt(&window, problem) != Starter::Outcome::kRefused) break;
  }
  // The recording ends before the first window is long enough.
  if (starter.attempts().empty())
    return attemptInitialization(whole_, *initializer.initializer, options_);
  InitializationAttempt last = starter.attempts().back();
  for (size_t i = 0; i + 1 < starter.attempts().size(); ++i) {
    const InitializationAttempt& earlier = starter.attempts()[i];
    last.initialize_ms += earlier.initialize_ms;
    last.stereo_odometry_ms += earlier.stereo_odometry_ms;
    last.used_stereo_odometry = last.used_stereo_odometry || earlier.used_stereo_odometry;
    last.vi_ba_ms += earlier.vi_ba_ms;
    for (const StageTiming& timing : earlier.init_timings) addTo(timing, &last.init_timings);
  }
  return last;
}

/** Problems are kept, because they share their stereo odometry between the initializers. */
InitializationProblem WindowTrial::problemOf(const KeyframeWindow& window,
                                             const WindowOptions& options) const {
  const std::vector<TimeNs> stamps(window.stamps().begin(), window.stamps().end());
  auto known = problems_.find(stamps);
  if (known == problems_.end())
    known =
        problems_.emplace(stamps, window.problem(tracks_.calibration, noise_, options, tracks_.imu))
            .first;
  return known->second;
}

WindowResult WindowTrial::record(const InitializationAttempt& attempt) const {
  WindowResult result = before_;
  if (attempt.keyframes != before_.attempt.keyframes) describe(attempt.keyframes, &result);
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
  WindowResult result = before_;
  result.initializer = initializer;
  result.attempt.status = status;
  result.attempt.reason = how;
  return result;
}

}  // namespace etalon
