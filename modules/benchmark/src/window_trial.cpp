#include "window_trial.h"

#include "etalon/benchmark/windows.h"
#include "etalon/runlog/attempt_record.h"

namespace etalon {

WindowTrial::WindowTrial(const WindowResult& result, const SequenceTracks& tracks,
                         const GroundTruthBound& bound, double every_s,
                         const ImuNoiseOptions& noise, const WindowOptions& options)
    : before_(result),
      tracks_(tracks),
      bound_(bound),
      options_(options),
      problem_(windowProblem(tracks, every_s, result.shape(), result.window, noise, options)) {
  options_.check_noise = true;
  std::vector<TimeNs>& keyframes = before_.attempt.keyframes;
  for (int k = 0; k < problem_.keyframeCount(); ++k) keyframes.push_back(problem_.keyframe(k).t);
  before_.gyro_bound = gyroWindowBound(tracks.ground_truth, tracks.imu, keyframes);
  for (const TimeNs t : keyframes)
    if (const auto state = tracks.ground_truth.at(t)) before_.truth.push_back(*state);
  if (keyframes.empty()) return;
  before_.t0 = keyframes.front();
  before_.attempt.t = keyframes.back();
}

WindowResult WindowTrial::tryWith(const ConfiguredInitializer& initializer) const {
  WindowResult result = before_;
  result.initializer = initializer.plugin.name;
  const InitializationAttempt attempt =
      attemptInitialization(problem_, *initializer.initializer, options_);
  result.attempt = makeAttemptRecord(attempt, options_.gravity_mps2, tracks_.ground_truth,
                                     bound_.foundGravityDirection());
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
