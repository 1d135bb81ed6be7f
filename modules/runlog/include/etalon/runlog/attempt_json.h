#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/printable.h"
#include "etalon/evaluation/window_metrics.h"
#include "etalon/runlog/initialization_json.h"
#include "etalon/runlog/json_members.h"

namespace etalon {

// The parts that the JSON of runs and of benchmarks share: attempts and their members.

/** A state without its biases. */
template <typename Archive>
void motionMembers(Archive& json, Member<Archive, StampedState>& state) {
  json("t_ns", state.t);
  json("p_WB_m", state.T_WB.t);
  Eigen::Vector4d q_xyzw = Eigen::Quaterniond(state.T_WB.R).coeffs();
  json("q_WB_xyzw", q_xyzw);
  json("v_WB_mps", state.v_WB);
  if constexpr (Archive::kReads) {
    json.expect(
        "q_WB_xyzw", [&] { return std::abs(q_xyzw.norm() - 1.0) < 1e-6; },
        "expected a unit quaternion");
    state.T_WB.R = Eigen::Quaterniond(q_xyzw).normalized().toRotationMatrix();
  }
}

/** A state of a stage, whose biases are members of the stage. */
struct StateOfStage : StampedState {};

template <typename Archive>
void members(Archive& json, Member<Archive, StateOfStage>& state) {
  motionMembers(json, state);
}

template <typename Archive>
void members(Archive& json, Member<Archive, WindowErrors>& e) {
  json("keyframes", e.keyframes);
  json("rre_deg", e.rre_deg);
  json("ate_m", e.ate_m);
  json("gravity_deg", e.gravity_deg);
  json("velocity_mps", e.velocity_mps);
  json("gyro_bias_rps", e.gyro_bias_rps);
  json("accel_bias_mps2", e.accel_bias_mps2);
  json("scale_error", e.scale_error);
  json.added("ate_yaw_m", e.ate_yaw_m);
  json.added("gravity_corrected_deg", e.gravity_corrected_deg);
  for (const WindowMetric& metric : neesMetrics()) json.added(metric.key, e.*metric.error);
}

template <typename Archive>
void members(Archive& json, Member<Archive, StageRecord>& stage) {
  json("stage", stage.stage);
  json("gravity_mps2", stage.gravity_mps2);
  json("gravity_B0_mps2", stage.gravity_B0);
  json("gyro_bias_rps", stage.bias.gyro);
  json("accel_bias_mps2", stage.bias.accel);
  json("errors", stage.errors);
  std::vector<StateOfStage> states;
  for (const StampedState& state : stage.states) states.push_back({state});
  json("states", states);
  if constexpr (Archive::kReads)
    for (const StateOfStage& state : states) {
      stage.states.push_back(state);
      stage.states.back().bias = stage.bias;
    }
  json.unlessNone("covariance_order", stage.covariance_order);
  json.unlessNone("covariance", stage.covariance);
}

template <typename Archive>
void members(Archive& json, Member<Archive, StageTiming>& timing) {
  json("stage", timing.stage);
  json("ms", timing.milliseconds);
}

template <typename Archive>
void members(Archive& json, Member<Archive, FoundExtrinsics>& found) {
  json("p_BC_m", found.T_BC.t);
  Eigen::Vector4d q_xyzw = Eigen::Quaterniond(found.T_BC.R).coeffs();
  json("q_BC_xyzw", q_xyzw);
  json("rotation_from_calibration_deg", found.rotation_deg);
  json("translation_from_calibration_m", found.translation_m);
  if constexpr (Archive::kReads)
    found.T_BC.R = Eigen::Quaterniond(q_xyzw).normalized().toRotationMatrix();
}

template <typename Archive>
void members(Archive& json, Member<Archive, RotationTimeOffset>& found) {
  json("images_later_s", found.offset_s);
  json("sigma_s", found.sigma_s);
  json("chi2_per_dof", found.chi2_per_dof);
  json("keyframe_pairs", found.pairs);
}

template <typename Archive>
void members(Archive& json, Member<Archive, AttemptRecord>& attempt) {
  json("stamp_ns", attempt.t);
  json.unlessNone("initializer", attempt.initializer);
  json("status", attempt.status);
  json("reason", attempt.reason);
  if constexpr (Archive::kReads) attempt.reason = printable(attempt.reason);
  json("reason_value", attempt.reason_value);
  json.added("reason_bound", attempt.reason_bound);
  json("milliseconds", attempt.timings);
  json("keyframes_ns", attempt.keyframes);
  json("stages", attempt.stages);
  if (Archive::kReads || attempt.extrinsics) json.added("extrinsics", attempt.extrinsics);
  if (Archive::kReads || attempt.time_offset) json.added("time_offset", attempt.time_offset);
  if (Archive::kReads || attempt.time_offset_used_s != 0.0)
    json.added("time_offset_used_s", attempt.time_offset_used_s);
}

}  // namespace etalon
