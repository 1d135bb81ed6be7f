#include "etalon/runlog/initialization_json.h"

#include <algorithm>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/runlog/attempt_json.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kCausalErrors[] = "trajectory_errors";
constexpr char kSmoothedErrors[] = "smoothed_trajectory_errors";
constexpr char kFinalErrors[] = "final_trajectory_errors";

/** Text with an indented line for every member of an object, and arrays of scalars on one line. */
void print(const Json& json, const std::string& indent, std::string* text) {
  const bool nested = std::any_of(json.begin(), json.end(), [](const Json& element) {
    return element.is_structured() && !element.empty();
  });
  if (!json.is_structured() || json.empty() || (json.is_array() && !nested)) {
    // A path need not be UTF-8; what is not becomes the replacement character.
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

Json statisticsJson(const RunStatistics& s) {
  Json json;
  json["stereo_frames"] = s.stereo_frames;
  json["imu_samples"] = s.imu_samples;
  json["unpaired_left"] = s.unpaired_left;
  json["unpaired_right"] = s.unpaired_right;
  json["unreadable_images"] = s.unreadable_images;
  json["frames_not_located"] = s.frames_not_located;
  if (!s.input_faults.empty()) json["input_faults"] = Json::array();
  for (const InputFaultRecord& f : s.input_faults)
    json["input_faults"].push_back({{"fault", f.fault},
                                    {"count", f.count},
                                    {"first_ns", f.first},
                                    {"value", numberJson(f.value)}});
  json["duration_s"] = numberJson(s.duration_s);
  json["wall_s"] = numberJson(s.wall_s);
  json["frame_median_ms"] = numberJson(s.frame_median_ms);
  if (!s.stages.empty()) json["stages"] = Json::array();
  for (const StageTimes& stage : s.stages)
    json["stages"].push_back({{"stage", stage.stage},
                              {"frames", stage.frames},
                              {"median_ms", numberJson(stage.median_ms)},
                              {"p99_ms", numberJson(stage.p99_ms)},
                              {"max_ms", numberJson(stage.max_ms)},
                              {"total_s", numberJson(stage.total_s)}});
  return json;
}

RunStatistics statisticsFromJson(const JsonReader& json) {
  RunStatistics s;
  s.stereo_frames = json.at("stereo_frames").count();
  s.imu_samples = json.at("imu_samples").count();
  s.unpaired_left = json.at("unpaired_left").count();
  s.unpaired_right = json.at("unpaired_right").count();
  s.unreadable_images = json.at("unreadable_images").count();
  s.frames_not_located = json.at("frames_not_located").count();
  if (json.has("input_faults"))
    for (const JsonReader& fault : json.at("input_faults").elements())
      s.input_faults.push_back({fault.at("fault").text(), fault.at("count").count(),
                                fault.at("first_ns").stamp(), fault.at("value").number()});
  s.duration_s = json.at("duration_s").number();
  s.wall_s = json.at("wall_s").number();
  s.frame_median_ms = json.at("frame_median_ms").number();
  if (json.has("stages"))
    for (const JsonReader& stage : json.at("stages").elements())
      s.stages.push_back({stage.at("stage").text(), stage.at("frames").count(),
                          stage.at("median_ms").number(), stage.at("p99_ms").number(),
                          stage.at("max_ms").number(), stage.at("total_s").number()});
  return s;
}

Json errorStatisticsJson(const ErrorStatistics& s) {
  return {{"count", s.count},
          {"rmse", numberJson(s.rmse)},
          {"mean", numberJson(s.mean)},
          {"median", numberJson(s.median)},
          {"max", numberJson(s.max)}};
}

ErrorStatistics errorStatisticsFromJson(const JsonReader& json) {
  ErrorStatistics s;
  s.count = static_cast<size_t>(json.at("count").count());
  s.rmse = json.at("rmse").number();
  s.mean = json.at("mean").number();
  s.median = json.at("median").number();
  s.max = json.at("max").number();
  return s;
}

Json trajectoryErrorsJson(const TrajectoryErrors& errors, bool initialised) {
  Json json;
  json["alignment"] = {{"position_m", "SE(3)"},
                       {"rotation_deg", initialised ? "yaw and position" : "SE(3)"}};
  json["position_m"] = errorStatisticsJson(errors.position_m);
  json["rotation_deg"] = errorStatisticsJson(errors.rotation_deg);
  return json;
}

std::optional<TrajectoryErrors> trajectoryErrorsFromJson(const JsonReader& run, const char* key) {
  if (!run.has(key)) return std::nullopt;
  const JsonReader errors = run.at(key);
  return TrajectoryErrors{errorStatisticsFromJson(errors.at("position_m")),
                          errorStatisticsFromJson(errors.at("rotation_deg"))};
}

Json finalBaJson(const FinalBaRecord& ba) {
  return {{"keyframes", ba.keyframes},
          {"landmarks", ba.landmarks},
          {"pixels", ba.pixels},
          {"inlier_pixels", ba.inlier_pixels},
          {"noise_factor", numberJson(ba.noise_factor)},
          {"iterations", ba.iterations},
          {"termination", ba.termination},
          {"wall_s", numberJson(ba.wall_s)}};
}

FinalBaRecord finalBaFromJson(const JsonReader& json) {
  FinalBaRecord ba;
  ba.keyframes = json.at("keyframes").count();
  ba.landmarks = json.at("landmarks").count();
  ba.pixels = json.at("pixels").count();
  ba.inlier_pixels = json.at("inlier_pixels").count();
  ba.noise_factor = json.at("noise_factor").number();
  ba.iterations = json.at("iterations").count();
  ba.termination = json.at("termination").text();
  ba.wall_s = json.at("wall_s").number();
  return ba;
}

Json eventJson(const EventRecord& event) {
  Json json = {{"t_ns", event.t}, {"state", event.state}, {"reason", event.reason}};
  if (event.jump)
    json["jump"] = {{"translation_m", numberJson(event.jump->translation_m)},
                    {"rotation_deg", numberJson(event.jump->rotation_deg)},
                    {"sigma_position_m", numberJson(event.jump->sigma_position_m)},
                    {"sigma_rotation_deg", numberJson(event.jump->sigma_rotation_deg)}};
  return json;
}

EventRecord eventFromJson(const JsonReader& json) {
  EventRecord event{json.at("t_ns").stamp(), json.at("state").text(), json.at("reason").text(), {}};
  if (!json.has("jump")) return event;
  const JsonReader jump = json.at("jump");
  event.jump = {jump.at("translation_m").number(), jump.at("rotation_deg").number(),
                jump.at("sigma_position_m").number(), jump.at("sigma_rotation_deg").number()};
  return event;
}

RunRecord recordFromJson(const JsonReader& json) {
  RunRecord record;
  if (!json.has("format") || json.at("format").text() != kRunFormat)
    json.fail(std::string("expected \"format\": \"") + kRunFormat + "\"");
  if (json.at("version").integer() != kRunFormatVersion)
    json.at("version").fail("expected version " + std::to_string(kRunFormatVersion));
  record.source = json.at("source").text();
  record.source_kind = json.at("source_kind").text();
  record.initializer = json.at("initializer").text();
  record.initializer_version = json.at("initializer_version").text();
  record.initializer_path = json.at("initializer_path").text();
  if (json.has("at_rest_initializer")) {
    record.at_rest_initializer = json.at("at_rest_initializer").text();
    record.at_rest_initializer_version = json.at("at_rest_initializer_version").text();
    record.at_rest_initializer_path = json.at("at_rest_initializer_path").text();
  }
  const JsonReader versions = json.at("versions");
  for (const std::string& name : versions.keys()) record.versions[name] = versions.at(name).text();
  record.first_image = json.at("first_image_ns").stamp();
  if (json.has("initialized_at_ns")) record.initialized_at = json.at("initialized_at_ns").stamp();
  if (json.has("handed_over_at_ns")) record.handed_over_at = json.at("handed_over_at_ns").stamp();
  record.statistics = statisticsFromJson(json.at("statistics"));
  for (const JsonReader& warning : json.at("warnings").elements())
    record.warnings.push_back(warning.text());
  if (json.has("ground_truth")) {
    const JsonReader use = json.at("ground_truth");
    record.ground_truth =
        GroundTruthUse{use.at("frames").count(), use.at("covered_frames").count()};
  }
  record.trajectory_errors = trajectoryErrorsFromJson(json, kCausalErrors);
  record.smoothed_errors = trajectoryErrorsFromJson(json, kSmoothedErrors);
  record.final_errors = trajectoryErrorsFromJson(json, kFinalErrors);
  if (json.has("final_ba")) record.final_ba = finalBaFromJson(json.at("final_ba"));
  if (json.has("events"))
    for (const JsonReader& event : json.at("events").elements())
      record.events.push_back(eventFromJson(event));
  for (const JsonReader& attempt : json.at("attempts").elements())
    record.attempts.push_back(attemptFromJson(attempt));
  record.config = json.at("config").text();
  return record;
}

}  // namespace

StageRecord StageRecord::fromStates(const std::string& stage, std::vector<KeyframeState> states,
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
  Json json;
  json["format"] = kRunFormat;
  json["version"] = kRunFormatVersion;
  json["source"] = record.source;
  json["source_kind"] = record.source_kind;
  json["initializer"] = record.initializer;
  json["initializer_version"] = record.initializer_version;
  json["initializer_path"] = record.initializer_path;
  if (!record.at_rest_initializer.empty()) {
    json["at_rest_initializer"] = record.at_rest_initializer;
    json["at_rest_initializer_version"] = record.at_rest_initializer_version;
    json["at_rest_initializer_path"] = record.at_rest_initializer_path;
  }
  json["versions"] = Json::object();
  for (const auto& [name, version] : record.versions) json["versions"][name] = version;
  json["first_image_ns"] = record.first_image;
  if (record.initialized_at) json["initialized_at_ns"] = *record.initialized_at;
  if (record.handed_over_at) json["handed_over_at_ns"] = *record.handed_over_at;
  json["statistics"] = statisticsJson(record.statistics);
  json["warnings"] = record.warnings;
  if (record.ground_truth)
    json["ground_truth"] = {{"frames", record.ground_truth->frames},
                            {"covered_frames", record.ground_truth->covered_frames}};
  const auto addErrors = [&](const char* key, const std::optional<TrajectoryErrors>& errors) {
    if (errors) json[key] = trajectoryErrorsJson(*errors, record.initialized_at.has_value());
  };
  addErrors(kCausalErrors, record.trajectory_errors);
  addErrors(kSmoothedErrors, record.smoothed_errors);
  addErrors(kFinalErrors, record.final_errors);
  if (record.final_ba) json["final_ba"] = finalBaJson(*record.final_ba);
  json["events"] = Json::array();
  for (const EventRecord& event : record.events) json["events"].push_back(eventJson(event));
  json["attempts"] = Json::array();
  for (const AttemptRecord& attempt : record.attempts)
    json["attempts"].push_back(attemptJson(attempt));
  json["config"] = record.config;
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
