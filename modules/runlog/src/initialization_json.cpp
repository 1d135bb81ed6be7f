#include "etalon/runlog/initialization_json.h"

#include <algorithm>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/runlog/attempt_json.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {

constexpr char kCausalErrors[] = "trajectory_errors";
constexpr char kSmoothedErrors[] = "smoothed_trajectory_errors";
constexpr char kFinalErrors[] = "final_trajectory_errors";

template <typename Archive>
void members(Archive& json, Member<Archive, InputFaultRecord>& fault) {
  json("fault", fault.fault);
  json("count", fault.count);
  json("first_ns", fault.first);
  json("value", fault.value);
}

template <typename Archive>
void members(Archive& json, Member<Archive, StageTimes>& stage) {
  json("stage", stage.stage);
  json("frames", stage.frames);
  json("median_ms", stage.median_ms);
  json("p99_ms", stage.p99_ms);
  json("max_ms", stage.max_ms);
  json("total_s", stage.total_s);
}

template <typename Archive>
void members(Archive& json, Member<Archive, RunStatistics>& s) {
  json("stereo_frames", s.stereo_frames);
  json("imu_samples", s.imu_samples);
  json("unpaired_left", s.unpaired_left);
  json("unpaired_right", s.unpaired_right);
  json("unreadable_images", s.unreadable_images);
  json("frames_not_located", s.frames_not_located);
  json.unlessNone("input_faults", s.input_faults);
  json("duration_s", s.duration_s);
  json("wall_s", s.wall_s);
  json("frame_median_ms", s.frame_median_ms);
  json.unlessNone("stages", s.stages);
}

template <typename Archive>
void members(Archive& json, Member<Archive, ErrorStatistics>& s) {
  json("count", s.count);
  json("rmse", s.rmse);
  json("mean", s.mean);
  json("median", s.median);
  json("max", s.max);
}

template <typename Archive>
void members(Archive& json, Member<Archive, TrajectoryErrors>& errors) {
  json("position_m", errors.position_m);
  json("rotation_deg", errors.rotation_deg);
}

template <typename Archive>
void members(Archive& json, Member<Archive, FinalBaRecord>& ba) {
  json("keyframes", ba.keyframes);
  json("landmarks", ba.landmarks);
  json("pixels", ba.pixels);
  json("inlier_pixels", ba.inlier_pixels);
  json("noise_factor", ba.noise_factor);
  json("iterations", ba.iterations);
  json("termination", ba.termination);
  json("wall_s", ba.wall_s);
}

template <typename Archive>
void members(Archive& json, Member<Archive, GroundTruthUse>& use) {
  json("frames", use.frames);
  json("covered_frames", use.covered_frames);
}

template <typename Archive>
void members(Archive& json, Member<Archive, EventRecord::Jump>& jump) {
  json("translation_m", jump.translation_m);
  json("rotation_deg", jump.rotation_deg);
  json("sigma_position_m", jump.sigma_position_m);
  json("sigma_rotation_deg", jump.sigma_rotation_deg);
}

template <typename Archive>
void members(Archive& json, Member<Archive, EventRecord>& event) {
  json("t_ns", event.t);
  json("state", event.state);
  json.added("remark", event.remark);
  json("reason", event.reason);
  json("jump", event.jump);
}

template <typename Archive>
void members(Archive& json, Member<Archive, CalibrationRecord>& finding) {
  json("group", finding.group);
  json("quantity", finding.quantity);
  json("unit", finding.unit);
  json("verdict", finding.verdict);
  json("value", finding.value);
  json("sigma", finding.sigma);
  json("used", finding.used);
  json("words", finding.words);
}

template <typename Archive>
void members(Archive& json, Member<Archive, RunRecord>& record) {
  json("source", record.source);
  json("source_kind", record.source_kind);
  json("initializer", record.initializer);
  json("initializer_version", record.initializer_version);
  json("initializer_path", record.initializer_path);
  json.unlessNone("at_rest_initializer", record.at_rest_initializer);
  if (!record.at_rest_initializer.empty()) {
    json("at_rest_initializer_version", record.at_rest_initializer_version);
    json("at_rest_initializer_path", record.at_rest_initializer_path);
  }
  json("versions", record.versions);
  json("first_image_ns", record.first_image);
  json("initialized_at_ns", record.initialized_at);
  json("handed_over_at_ns", record.handed_over_at);
  json("statistics", record.statistics);
  json("warnings", record.warnings);
  json("ground_truth", record.ground_truth);
  json(kCausalErrors, record.trajectory_errors);
  json(kSmoothedErrors, record.smoothed_errors);
  json(kFinalErrors, record.final_errors);
  json("final_ba", record.final_ba);
  json.added("events", record.events);
  json.unlessNone("calibration", record.calibration);
  json("attempts", record.attempts);
  json("config", record.config);
}

namespace {

using Json = nlohmann::ordered_json;

/** Appends text with an indented line for every member of an object, arrays of scalars on one. */
void print(const Json& json, const std::string& indent, std::string* text) {
  const bool nested = std::any_of(json.begin(), json.end(), [](const Json& element) {
    return element.is_structured() && !element.empty();
  });
  if (!json.is_structured() || json.empty() || (json.is_array() && !nested)) {
    // A path need not be UTF-8; invalid bytes become the replacement character.
    *text += json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  const std::string inner = indent + " ";
  const char* separator = json.is_object() ? "{\n" : "[\n";
  for (const auto& item : json.items()) {
    *text += separator + inner;
    if (json.is_object()) *text += Json(item.key()).dump() + ": ";
    print(item.value(), inner, text);
    separator = ",\n";
  }
  *text += "\n" + indent + (json.is_object() ? "}" : "]");
}

RunRecord recordFromJson(const JsonReader& json) {
  if (!json.has("format") || json.at("format").text() != kRunFormat)
    json.fail(std::string("expected \"format\": \"") + kRunFormat + "\"");
  if (json.at("version").integer() != kRunFormatVersion)
    json.at("version").fail("expected version " + std::to_string(kRunFormatVersion));
  return fromJson<RunRecord>(json);
}

}  // namespace

StageRecord StageRecord::fromStates(const std::string& stage, std::vector<StampedState> states,
                                    const ImuBias& bias, double gravity_mps2) {
  StageRecord record;
  record.stage = stage;
  record.states = std::move(states);
  record.bias = bias;
  record.gravity_mps2 = gravity_mps2;
  if (!record.states.empty())
    record.gravity_B0 =
        record.states.front().T_WB.R.transpose() * Eigen::Vector3d(0.0, 0.0, -gravity_mps2);
  return record;
}

const StageRecord* AttemptRecord::stage(const std::string& name) const {
  for (const StageRecord& record : stages)
    if (record.stage == name) return &record;
  return nullptr;
}

double AttemptRecord::milliseconds(const std::string& name) const {
  for (const StageTiming& timing : timings)
    if (timing.stage == name) return timing.milliseconds;
  return WindowErrors::kNone;
}

const AttemptRecord* RunRecord::acceptedAttempt() const {
  for (const AttemptRecord& attempt : attempts)
    if (attempt.accepted()) return &attempt;
  return nullptr;
}

std::string toJson(const RunRecord& record) {
  Json json = {{"format", kRunFormat}, {"version", kRunFormatVersion}};
  json.update(asJson(record));
  for (const char* const errors : {kCausalErrors, kSmoothedErrors, kFinalErrors})
    if (json.contains(errors))
      json[errors]["alignment"] = {
          {"position_m", "SE(3)"},
          {"rotation_deg", record.initialized_at ? "yaw and position" : "SE(3)"}};
  std::string text;
  print(json, "", &text);
  return text + "\n";
}

RunRecord runRecordFromJson(const std::string& json, const std::string& name) {
  nlohmann::json document;
  try {
    document = nlohmann::json::parse(json);
  } catch (const nlohmann::json::exception& e) {
    throw DataError(name, 0, std::string("expected JSON: ") + e.what());
  }
  return recordFromJson(JsonReader(document, name));
}

void writeInitializationJson(const std::string& path, const RunRecord& record) {
  writeFile(path, toJson(record));
}

}  // namespace etalon
