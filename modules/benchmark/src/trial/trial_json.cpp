#include "trial/trial_json.h"

#include "etalon/runlog/json_members.h"
#include "record_json.h"
#include "suite/suite_json.h"

namespace etalon {

constexpr const char* kTrialFormat = "etalon trial";
/** Raised when the meaning of a key changes. */
constexpr int kTrialFormatVersion = 2;

template <typename Archive>
void members(Archive& json, Member<Archive, TrialProtocol>& protocol) {
  json("seconds", protocol.seconds);
  json("starts", protocol.starts);
  json("from_s", protocol.from_s);
  json("ate_limit_m", protocol.ate_limit_m);
  json("seed", protocol.seed);
}

template <typename Archive>
void members(Archive& json, Member<Archive, NamedText>& named) {
  json("name", named.name);
  json("text", named.text);
}

/** All members but the results. */
template <typename Archive>
void members(Archive& json, Member<Archive, TrialRecord>& record) {
  json("protocol", record.protocol);
  json("settings", record.settings);
  json("odometries", record.odometries);
  json("faults", record.faults);
  json("systems", record.systems);
  members<Archive>(json, static_cast<Member<Archive, SuiteRecord>&>(record));
}

template <typename Archive>
void members(Archive& json, Member<Archive, TrialErrors>& e) {
  json("ate_m", e.ate_m);
  json("ate_yaw_m", e.ate_yaw_m);
  json("rotation_deg", e.rotation_deg);
  json("rpe_m", e.rpe_m);
  json("rpe_deg", e.rpe_deg);
}

template <typename Archive>
void members(Archive& json, Member<Archive, ErrorsAfterStart>& e) {
  json("after_s", e.after_s);
  json("ate_m", e.ate_m);
  json("velocity_mps", e.velocity_mps);
  json("tilt_deg", e.tilt_deg);
}

template <typename Archive>
void members(Archive& json, Member<Archive, TrialRun>& run) {
  json("recording", run.recording);
  json("from_s", run.from_s);
  json("system", run.variant.system);
  json("setting", run.variant.setting);
  json("odometry", run.variant.odometry);
  json("initializer", run.variant.initializer);
  json("fault", run.fault);
  json("status", run.status);
  json("reason", run.reason);
  json("silent", run.silent);
  json("seconds", run.seconds);
  json("images", run.images);
  json("frames", run.frames);
  json("poses", run.poses);
  json("fault_at_s", run.fault_at_s);
  json("started_s", run.started_s);
  json("end_state", run.end_state);
  json("dead_reckoning_s", run.dead_reckoning_s);
  json("lost_s", run.lost_s);
  json("event", run.event);
  json("causal", run.causal);
  json("smoothed", run.smoothed);
  json("error_over_predicted", run.error_over_predicted);
  json("after_start", run.after_start);
  json("frame_ms", run.frame_ms);
}

nlohmann::ordered_json trialHeadJson(const TrialRecord& record) {
  nlohmann::ordered_json json = {{"format", kTrialFormat}, {"version", kTrialFormatVersion}};
  json.update(asJson(record));
  return json;
}

TrialRecord trialHeadFromJson(const JsonReader& json) {
  checkFormat(json, kTrialFormat, kTrialFormatVersion);
  return fromJson<TrialRecord>(json);
}

nlohmann::ordered_json trialRunJson(const TrialRun& run) { return asJson(run); }

TrialRun trialRunFromJson(const JsonReader& json) { return fromJson<TrialRun>(json); }

}  // namespace etalon
