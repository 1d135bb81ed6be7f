#include "report_data.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <tuple>

#include "etalon/benchmark/summary.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/alignment.h"
#include "etalon/evaluation/window_metrics.h"
#include "report_page.h"

namespace etalon {
namespace {

using Json = nlohmann::json;

constexpr double kPositionUnit = 1e-5;    ///< m
constexpr double kLargestPosition = 1e9;  ///< m; beyond it an estimate is not drawn

Json numberOr(const Json& number, const Json& otherwise) {
  return number.is_null() ? otherwise : number;
}

/** Texts that the data hold once and refer to by number. */
class Dictionary {
 public:
  size_t operator()(const std::string& text) {
    const auto [place, is_new] = index_.emplace(text, texts_.size());
    if (is_new) texts_.push_back(text);
    return place->second;
  }
  const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::map<std::string, size_t> index_;
  std::vector<std::string> texts_;
};

void appendPosition(const Eigen::Vector3d& p, Json* flat) {
  for (int i = 0; i < 3; ++i) flat->push_back(std::llround(p[i] / kPositionUnit));
}

bool canBeDrawn(const std::vector<StampedState>& states) {
  return !states.empty() && std::all_of(states.begin(), states.end(), [](const StampedState& s) {
    return s.T_WB.t.allFinite() && s.T_WB.t.norm() < kLargestPosition;
  });
}

/** The keyframes that an estimate is aligned with: ground truth; without it the last stage. */
std::map<TimeNs, Eigen::Vector3d> referenceOf(const WindowResult& result) {
  std::map<TimeNs, Eigen::Vector3d> reference;
  for (const StampedState& state : result.truth)
    if (state.T_WB.t.allFinite()) reference.emplace(state.t, state.T_WB.t);
  if (!reference.empty()) return reference;
  for (auto stage = result.attempt.stages.rbegin(); stage != result.attempt.stages.rend();
       ++stage) {
    if (!canBeDrawn(stage->states)) continue;
    for (const StampedState& state : stage->states) reference.emplace(state.t, state.T_WB.t);
    return reference;
  }
  return reference;
}

/** Keyframe positions after alignment in yaw and position, relative to the reference's first. */
Json positionsOf(const StageRecord& stage, const std::map<TimeNs, Eigen::Vector3d>& reference) {
  if (!canBeDrawn(stage.states)) return nullptr;
  std::vector<Eigen::Vector3d> p_G, p_W;
  for (const StampedState& state : stage.states) {
    const auto match = reference.find(state.t);
    if (match == reference.end()) continue;
    p_G.push_back(match->second);
    p_W.push_back(state.T_WB.t);
  }
  if (p_G.empty()) return nullptr;
  const Alignment alignment = alignPoints(p_G, p_W, AlignmentType::kYawPosition);
  Json flat = Json::array();
  for (const StampedState& state : stage.states)
    appendPosition(alignment * state.T_WB.t - reference.begin()->second, &flat);
  return flat;
}

Json noiseOf(const WindowResult& result) {
  if (!result.noise) return nullptr;
  Json groups = Json::array();
  for (const ResidualGroup& group : {result.noise->gyro, result.noise->accel, result.noise->vision})
    groups.push_back({rounded(group.chi2), rounded(group.dof)});
  return groups;
}

/** Builds the results of the data and the dictionaries that they refer to. */
class ResultData {
 public:
  explicit ResultData(const BenchmarkRecord& record)
      : metrics_(windowMetrics()), last_stage_(record.protocol.vi_ba ? kStageViBa : kStageInit) {
    for (const BenchmarkSequence& sequence : record.sequences) {
      first_images_.push_back(sequence.first_image);
      sequences_(sequence.name);
    }
    for (const BenchmarkInitializer& initializer : record.initializers)
      initializers_(initializer.name);
    const auto init = judgedSuccess(record, kStageInit);
    const auto vi_ba = judgedSuccess(record, kStageViBa);
    for (size_t i = 0; i < record.results.size(); ++i)
      add(record.results[i], record.protocol.every_s, {init[i], vi_ba[i]});
  }

  void writeTo(Json* data) {
    (*data)["shapes"] = shapes_;
    (*data)["statuses"] = statuses_.texts();
    (*data)["reasons"] = reasons_.texts();
    (*data)["timings"] = timings_.texts();
    (*data)["frames"] = std::move(frames_);
    (*data)["results"] = std::move(results_);
    (*data)["sequence_names"] = sequences_.texts();
    (*data)["initializer_names"] = initializers_.texts();
  }

 private:
  size_t shapeOf(const WindowResult& result) {
    const Json shape = {result.keyframes, rounded(result.rate_hz)};
    const auto place = std::find(shapes_.begin(), shapes_.end(), shape);
    const size_t index = place - shapes_.begin();
    if (place == shapes_.end()) shapes_.push_back(shape);
    return index;
  }

  /** Stamps of the window's keyframes and true positions: the same for all initializers, but for
   * windows that grew to other numbers of keyframes. */
  size_t framesOf(const WindowResult& result, size_t sequence, size_t shape) {
    const std::vector<TimeNs>& stamps = result.attempt.keyframes;
    const auto key = std::make_tuple(sequence, shape, result.window, stamps.size());
    const auto [place, is_new] = frame_index_.emplace(key, frames_.size());
    if (!is_new) return place->second;
    frames_.push_back({Json::array(), nullptr});
    Json& frame = frames_.back();
    std::map<TimeNs, Eigen::Vector3d> truth;
    for (const StampedState& state : result.truth)
      if (state.T_WB.t.allFinite()) truth.emplace(state.t, state.T_WB.t);
    Json positions = Json::array();
    for (const TimeNs t : stamps) {
      frame[0].push_back(rounded(secondsBetween(stamps.front(), t)));
      const auto match = truth.find(t);
      if (match != truth.end())
        appendPosition(match->second - truth.begin()->second, &positions);
      else
        for (int i = 0; i < 3; ++i) positions.push_back(nullptr);
    }
    if (!truth.empty()) frame[1] = std::move(positions);
    return place->second;
  }

  Json stageOf(const WindowResult& result, const char* name,
               const std::map<TimeNs, Eigen::Vector3d>& reference) const {
    const StageRecord* stage = result.attempt.stage(name);
    if (stage == nullptr) return nullptr;
    Json errors = Json::array();
    const WindowErrors none;
    for (const WindowMetric& metric : metrics_)
      errors.push_back(rounded((stage->errors ? *stage->errors : none).*metric.error));
    return {std::move(errors), positionsOf(*stage, reference)};
  }

  /** What of an accepted estimate is off by more than its own covariance claims, such as "tilt,
   * velocity"; null where this cannot be judged. */
  Json outsideClaimOf(const WindowResult& result, const std::optional<bool>& success) {
    const StageRecord* last = result.attempt.stage(last_stage_);
    if (!success || !result.attempt.accepted() || !last || !last->errors) return nullptr;
    return reasons_(joined(last->errors->outsideClaim()));
  }

  void add(const WindowResult& result, double every_s,
           const std::vector<std::optional<bool>>& successes) {
    const size_t sequence = sequences_(result.sequence);
    const size_t shape = shapeOf(result);
    const TimeNs first = sequence < first_images_.size() ? first_images_[sequence] : 0;
    const double start_s = result.attempt.keyframes.empty() && result.t0 == 0
                               ? result.window * every_s
                               : secondsBetween(first, result.t0);
    Json judged = Json::array();
    for (const std::optional<bool>& success : successes)
      judged.push_back(success ? Json(*success ? 1 : 0) : Json(nullptr));
    Json timings = Json::array();
    for (const StageTiming& timing : result.attempt.timings)
      timings.push_back({timings_(timing.stage), rounded(timing.milliseconds)});
    const std::map<TimeNs, Eigen::Vector3d> reference = referenceOf(result);
    // A start is read in hundredths of a second.
    const double start_ms = std::round(1e3 * start_s);
    results_.push_back(Json::array(
        {sequence, shape, result.window, rounded(1e-3 * start_ms + 0.0),
         initializers_(result.initializer), statuses_(result.attempt.status),
         reasons_(result.attempt.reason), framesOf(result, sequence, shape), std::move(judged),
         std::move(timings),
         Json::array(
             {stageOf(result, kStageInit, reference), stageOf(result, kStageViBa, reference)}),
         noiseOf(result), outsideClaimOf(result, successes[last_stage_ == kStageViBa ? 1 : 0])}));
  }

  std::vector<WindowMetric> metrics_;
  std::string last_stage_;
  std::vector<TimeNs> first_images_;
  Dictionary sequences_, initializers_, statuses_, reasons_, timings_;
  std::map<std::tuple<size_t, size_t, int, size_t>, size_t> frame_index_;
  Json shapes_ = Json::array(), frames_ = Json::array(), results_ = Json::array();
};

Json metricsData() {
  Json metrics = Json::array();
  for (const WindowMetric& m : windowMetrics()) {
    Json metric = {{"key", m.key},       {"name", m.name},         {"title", m.title},
                   {"factor", m.factor}, {"decimals", m.decimals}, {"limit", nullptr}};
    if (m.key == "gravity_deg") metric["limit"] = kSuccessGravityDeg;
    if (m.key == "velocity_mps") metric["limit"] = kSuccessVelocityMps;
    metrics.push_back(std::move(metric));
  }
  return metrics;
}

Json sequencesData(const BenchmarkRecord& record) {
  Json sequences = Json::array();
  for (const BenchmarkSequence& s : record.sequences) {
    Json bounds = Json::array();  // a shape each, in the order of data.shapes
    for (const auto& shape : shapesOf(record))
      bounds.push_back(
          rounded(truthCheck(record, shape, s.name, &WindowTruthCheck::rre_deg).median));
    sequences.push_back({{"name", s.name},
                         {"duration_s", rounded(s.duration_s)},
                         {"has_ground_truth", s.has_ground_truth},
                         {"bound_rre_deg", std::move(bounds)},
                         {"error", s.error}});
  }
  return sequences;
}

}  // namespace

nlohmann::json reportData(const BenchmarkRecord& record) {
  Json data;
  data["every_s"] = numberOr(rounded(record.protocol.every_s), 0);
  data["vi_ba"] = record.protocol.vi_ba;
  data["position_unit_m"] = kPositionUnit;
  data["metrics"] = metricsData();
  data["sequences"] = sequencesData(record);
  data["initializers"] = Json::array();
  for (const BenchmarkInitializer& i : record.initializers)
    data["initializers"].push_back(
        {{"name", i.name}, {"version", i.version}, {"description", i.description}});
  ResultData(record).writeTo(&data);
  return data;
}

}  // namespace etalon
