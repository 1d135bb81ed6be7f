#include "slot_trial.h"

#include "etalon/benchmark/benchmark_slots.h"
#include "etalon/runlog/attempt_record.h"

namespace etalon {

SlotTrial::SlotTrial(const SlotRecord& slot, const SequenceTracks& tracks,
                     const GroundTruthFloor& floor, double every_s, const ImuNoiseOptions& noise,
                     const WindowOptions& options)
    : before_(slot),
      tracks_(tracks),
      floor_(floor),
      options_(options),
      problem_(slotProblem(tracks, every_s, {slot.keyframes, slot.rate_hz}, slot.segment,
                           noise.apply(tracks.calibration.imu.noise), options)) {
  options_.check_noise = true;
  std::vector<TimeNs>& keyframes = before_.attempt.keyframes;
  for (int k = 0; k < problem_.keyframeCount(); ++k) keyframes.push_back(problem_.keyframe(k).t);
  before_.gyro_floor = gyroWindowFloor(tracks.ground_truth, tracks.imu, keyframes);
  for (const TimeNs t : keyframes)
    if (const auto state = tracks.ground_truth.at(t)) before_.truth.push_back(*state);
  if (keyframes.empty()) return;
  before_.t0 = keyframes.front();
  before_.attempt.t = keyframes.back();
}

SlotRecord SlotTrial::tryWith(const ConfiguredInitializer& initializer) const {
  SlotRecord slot = before_;
  slot.initializer = initializer.plugin.name;
  const InitializationAttempt attempt =
      attemptInitialization(problem_, *initializer.initializer, options_);
  slot.attempt = makeAttemptRecord(attempt, options_.gravity_mps2, tracks_.ground_truth,
                                   floor_.foundGravityDirection());
  for (StageRecord& stage : slot.attempt.stages) {
    stage.covariance.resize(0, 0);
    stage.covariance_order.clear();
  }
  if (attempt.has_vi_ba && attempt.vi_ba.noise.gyro.dof > 0.0) slot.noise = attempt.vi_ba.noise;
  return slot;
}

SlotRecord SlotTrial::lost(const std::string& initializer, const std::string& status,
                           const std::string& how) const {
  SlotRecord slot = before_;
  slot.initializer = initializer;
  slot.attempt.status = status;
  slot.attempt.reason = how;
  return slot;
}

}  // namespace etalon
