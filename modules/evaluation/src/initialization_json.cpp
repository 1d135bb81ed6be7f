#include "etalon/evaluation/initialization_json.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"
#include "json_reader.h"

namespace etalon {
namespace {

using Json = nlohmann::ordered_json;

/** nlohmann writes what is not finite as null by itself; this says so. */
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

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

template <typename Vector>
Json vectorJson(const Vector& v) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) json.push_back(number(v[i]));
  return json;
}

Json stateJson(const KeyframeState& state) {
  const Eigen::Quaterniond q(state.T_WB.R);
  Json json;
  json["t_ns"] = state.t;
  json["p_WB_m"] = vectorJson(state.T_WB.t);
  json["q_WB_xyzw"] = vectorJson(q.coeffs());
  json["v_WB_mps"] = vectorJson(state.v_WB);
  return json;
}

KeyframeState stateFromJson(const JsonReader& json) {
  KeyframeState state;
  state.t = json.at("t_ns").integer();
  state.T_WB.t = json.at("p_WB_m").vector<3>();
  const Eigen::Vector4d q = json.at("q_WB_xyzw").vector<4>();
  if (!(std::abs(q.norm() - 1.0) < 1e-6)) json.at("q_WB_xyzw").fail("expected a unit quaternion");
  state.T_WB.R = Eigen::Quaterniond(q).normalized().toRotationMatrix();
  state.v_WB = json.at("v_WB_mps").vector<3>();
  return state;
}

Json errorsJson(const SegmentErrors& e) {
  Json json;
  json["keyframes"] = e.keyframes;
  json["rre_deg"] = number(e.rre_deg);
  json["ate_m"] = number(e.ate_m);
  json["gravity_deg"] = number(e.gravity_deg);
  json["velocity_mps"] = number(e.velocity_mps);
  json["gyro_bias_rps"] = number(e.gyro_bias_rps);
  json["accel_bias_mps2"] = number(e.accel_bias_mps2);
  json["scale_error"] = number(e.scale_error);
  json["ate_yaw_m"] = number(e.ate_yaw_m);
  json["gravity_corrected_deg"] = number(e.gravity_corrected_deg);
  return json;
}

SegmentErrors errorsFromJson(const JsonReader& json) {
  SegmentErrors e;
  e.keyframes = json.at("keyframes").count();
  e.rre_deg = json.at("rre_deg").number();
  e.ate_m = json.at("ate_m").number();
  e.gravity_deg = json.at("gravity_deg").number();
  e.velocity_mps = json.at("velocity_mps").number();
  e.gyro_bias_rps = json.at("gyro_bias_rps").number();
  e.accel_bias_mps2 = json.at("accel_bias_mps2").number();
  e.scale_error = json.at("scale_error").number();
  if (json.has("ate_yaw_m")) e.ate_yaw_m = json.at("ate_yaw_m").number();
  if (json.has("gravity_corrected_deg"))
    e.gravity_corrected_deg = json.at("gravity_corrected_deg").number();
  return e;
}

Json stageJson(const StageRecord& stage) {
  Json json;
  json["stage"] = stage.stage;
  json["gravity_mps2"] = number(stage.gravity_mps2);
  json["gravity_B0_mps2"] = vectorJson(stage.gravity_B0);
  json["gyro_bias_rps"] = vectorJson(stage.bias.gyro);
  json["accel_bias_mps2"] = vectorJson(stage.bias.accel);
  if (stage.errors) json["errors"] = errorsJson(*stage.errors);
  json["states"] = Json::array();
  for (const KeyframeState& state : stage.states) json["states"].push_back(stateJson(state));
  if (stage.covariance.size() > 0) {
    json["covariance_order"] = stage.covariance_order;
    json["covariance"] = Json::array();
    for (Eigen::Index row = 0; row < stage.covariance.rows(); ++row)
      json["covariance"].push_back(vectorJson(stage.covariance.row(row)));
  }
  return json;
}

Eigen::MatrixXd matrixFromJson(const JsonReader& json) {
  const std::vector<JsonReader> rows = json.elements();
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd matrix(n, n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::vector<JsonReader> row = rows[static_cast<size_t>(r)].elements();
    if (row.size() != rows.size()) json.fail("expected a square matrix");
    for (Eigen::Index c = 0; c < n; ++c) matrix(r, c) = row[static_cast<size_t>(c)].number();
  }
  return matrix;
}

StageRecord stageFromJson(const JsonReader& json) {
  StageRecord stage;
  stage.stage = json.at("stage").text();
  stage.gravity_mps2 = json.at("gravity_mps2").number();
  stage.gravity_B0 = json.at("gravity_B0_mps2").vector<3>();
  stage.bias.gyro = json.at("gyro_bias_rps").vector<3>();
  stage.bias.accel = json.at("accel_bias_mps2").vector<3>();
  if (json.has("errors")) stage.errors = errorsFromJson(json.at("errors"));
  for (const JsonReader& state : json.at("states").elements())
    stage.states.push_back(stateFromJson(state));
  if (json.has("covariance")) {
    stage.covariance_order = json.at("covariance_order").text();
    stage.covariance = matrixFromJson(json.at("covariance"));
  }
  return stage;
}

Json attemptJson(const AttemptRecord& attempt) {
  Json json;
  json["stamp_ns"] = attempt.t;
  json["status"] = attempt.status;
  json["reason"] = attempt.reason;
  json["reason_value"] = number(attempt.reason_value);
  json["milliseconds"] = Json::array();
  for (const StageTiming& timing : attempt.timings)
    json["milliseconds"].push_back({{"stage", timing.stage}, {"ms", number(timing.milliseconds)}});
  json["keyframes_ns"] = attempt.keyframes;
  json["stages"] = Json::array();
  for (const StageRecord& stage : attempt.stages) json["stages"].push_back(stageJson(stage));
  return json;
}

AttemptRecord attemptFromJson(const JsonReader& json) {
  AttemptRecord attempt;
  attempt.t = json.at("stamp_ns").integer();
  attempt.status = json.at("status").text();
  attempt.reason = json.at("reason").text();
  attempt.reason_value = json.at("reason_value").number();
  for (const JsonReader& timing : json.at("milliseconds").elements())
    attempt.timings.push_back({timing.at("stage").text(), timing.at("ms").number()});
  for (const JsonReader& t : json.at("keyframes_ns").elements())
    attempt.keyframes.push_back(t.integer());
  for (const JsonReader& stage : json.at("stages").elements())
    attempt.stages.push_back(stageFromJson(stage));
  return attempt;
}

Json statisticsJson(const RunStatistics& s) {
  Json json;
  json["stereo_frames"] = s.stereo_frames;
  json["imu_samples"] = s.imu_samples;
  json["unpaired_left"] = s.unpaired_left;
  json["unpaired_right"] = s.unpaired_right;
  json["unreadable_images"] = s.unreadable_images;
  json["frames_not_located"] = s.frames_not_located;
  json["duration_s"] = number(s.duration_s);
  json["wall_s"] = number(s.wall_s);
  json["frame_median_ms"] = number(s.frame_median_ms);
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
  s.duration_s = json.at("duration_s").number();
  s.wall_s = json.at("wall_s").number();
  s.frame_median_ms = json.at("frame_median_ms").number();
  return s;
}

Json errorStatisticsJson(const ErrorStatistics& s) {
  return {{"count", s.count},
          {"rmse", number(s.rmse)},
          {"mean", number(s.mean)},
          {"median", number(s.median)},
          {"max", number(s.max)}};
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
  const JsonReader versions = json.at("versions");
  for (const std::string& name : versions.keys()) record.versions[name] = versions.at(name).text();
  record.first_image = json.at("first_image_ns").integer();
  if (json.has("initialized_at_ns")) record.initialized_at = json.at("initialized_at_ns").integer();
  record.statistics = statisticsFromJson(json.at("statistics"));
  for (const JsonReader& warning : json.at("warnings").elements())
    record.warnings.push_back(warning.text());
  if (json.has("trajectory_errors")) {
    const JsonReader errors = json.at("trajectory_errors");
    record.trajectory_errors = {errorStatisticsFromJson(errors.at("position_m")),
                                errorStatisticsFromJson(errors.at("rotation_deg"))};
  }
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
  return SegmentErrors::kNone;
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
  json["versions"] = Json::object();
  for (const auto& [name, version] : record.versions) json["versions"][name] = version;
  json["first_image_ns"] = record.first_image;
  if (record.initialized_at) json["initialized_at_ns"] = *record.initialized_at;
  json["statistics"] = statisticsJson(record.statistics);
  json["warnings"] = record.warnings;
  if (record.trajectory_errors) {
    json["trajectory_errors"]["position_m"] =
        errorStatisticsJson(record.trajectory_errors->position_m);
    json["trajectory_errors"]["rotation_deg"] =
        errorStatisticsJson(record.trajectory_errors->rotation_deg);
  }
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
  } catch (const nlohmann::json::parse_error& e) {
    throw DataError(name, 0, std::string("expected JSON: ") + e.what());
  }
  return recordFromJson(JsonReader(document, name));
}

void writeInitializationJson(const std::string& path, const RunRecord& record) {
  std::ofstream out(path, std::ios::binary);
  if (!out) throw DataError(path, 0, std::string("cannot be written: ") + std::strerror(errno));
  out << toJson(record);
  out.close();
  if (!out) throw DataError(path, 0, "could not be written completely (disk full?)");
}

RunRecord readInitializationJson(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    throw DataError(path, 0, "cannot be read; expected the initialization.json of a run");
  return runRecordFromJson(text.str(), path);
}

}  // namespace etalon
