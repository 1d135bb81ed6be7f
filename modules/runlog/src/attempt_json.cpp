#include "etalon/runlog/attempt_json.h"

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/printable.h"
#include "etalon/evaluation/window_metrics.h"

namespace etalon {

using Json = nlohmann::ordered_json;

Json numberJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

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
  state.t = json.at("t_ns").stamp();
  state.T_WB.t = json.at("p_WB_m").vector<3>();
  const Eigen::Vector4d q = json.at("q_WB_xyzw").vector<4>();
  if (!(std::abs(q.norm() - 1.0) < 1e-6)) json.at("q_WB_xyzw").fail("expected a unit quaternion");
  state.T_WB.R = Eigen::Quaterniond(q).normalized().toRotationMatrix();
  state.v_WB = json.at("v_WB_mps").vector<3>();
  return state;
}

namespace {

Json errorsJson(const WindowErrors& e) {
  Json json;
  json["keyframes"] = e.keyframes;
  json["rre_deg"] = numberJson(e.rre_deg);
  json["ate_m"] = numberJson(e.ate_m);
  json["gravity_deg"] = numberJson(e.gravity_deg);
  json["velocity_mps"] = numberJson(e.velocity_mps);
  json["gyro_bias_rps"] = numberJson(e.gyro_bias_rps);
  json["accel_bias_mps2"] = numberJson(e.accel_bias_mps2);
  json["scale_error"] = numberJson(e.scale_error);
  json["ate_yaw_m"] = numberJson(e.ate_yaw_m);
  json["gravity_corrected_deg"] = numberJson(e.gravity_corrected_deg);
  for (const WindowMetric& metric : neesMetrics()) json[metric.key] = numberJson(e.*metric.error);
  return json;
}

WindowErrors errorsFromJson(const JsonReader& json) {
  WindowErrors e;
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
  for (const WindowMetric& metric : neesMetrics())
    if (json.has(metric.key)) e.*metric.error = json.at(metric.key).number();
  return e;
}

Json stageJson(const StageRecord& stage) {
  Json json;
  json["stage"] = stage.stage;
  json["gravity_mps2"] = numberJson(stage.gravity_mps2);
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

}  // namespace

Json attemptJson(const AttemptRecord& attempt) {
  Json json;
  json["stamp_ns"] = attempt.t;
  if (!attempt.initializer.empty()) json["initializer"] = attempt.initializer;
  json["status"] = attempt.status;
  json["reason"] = attempt.reason;
  json["reason_value"] = numberJson(attempt.reason_value);
  json["reason_bound"] = numberJson(attempt.reason_bound);
  json["milliseconds"] = Json::array();
  for (const StageTiming& timing : attempt.timings)
    json["milliseconds"].push_back(
        {{"stage", timing.stage}, {"ms", numberJson(timing.milliseconds)}});
  json["keyframes_ns"] = attempt.keyframes;
  json["stages"] = Json::array();
  for (const StageRecord& stage : attempt.stages) json["stages"].push_back(stageJson(stage));
  return json;
}

AttemptRecord attemptFromJson(const JsonReader& json) {
  AttemptRecord attempt;
  attempt.t = json.at("stamp_ns").stamp();
  if (json.has("initializer")) attempt.initializer = json.at("initializer").text();
  attempt.status = json.at("status").text();
  attempt.reason = printable(json.at("reason").text());
  attempt.reason_value = json.at("reason_value").number();
  if (json.has("reason_bound")) attempt.reason_bound = json.at("reason_bound").number();
  for (const JsonReader& timing : json.at("milliseconds").elements())
    attempt.timings.push_back({timing.at("stage").text(), timing.at("ms").number()});
  for (const JsonReader& t : json.at("keyframes_ns").elements())
    attempt.keyframes.push_back(t.stamp());
  for (const JsonReader& stage : json.at("stages").elements())
    attempt.stages.push_back(stageFromJson(stage));
  return attempt;
}

}  // namespace etalon
