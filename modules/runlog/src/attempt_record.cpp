#include "etalon/runlog/attempt_record.h"

#include "etalon/evaluation/consistency.h"
#include "etalon/initialization/predicted_errors.h"

namespace etalon {
namespace {

constexpr const char* kInitCovarianceOrder =
    "b_g [rad/s], b_a [m/s^2], gravity direction [rad, 2], v_WB of the last keyframe [m/s]; "
    "then, where it is known, rotation [rad, right perturbation] and position [m] of the other "
    "keyframes relative to the first";
constexpr const char* kViBaCovarianceOrder =
    "rotation [rad, right perturbation], position [m], v_WB [m/s] of every keyframe, then b_g "
    "[rad/s], b_a [m/s^2]";

/** The ground truth that a stage is compared with. */
struct Truth {
  const GroundTruth& ground_truth;
  const std::optional<Eigen::Vector3d>& gravity_direction_G;
};

StageRecord makeStage(const std::string& name, std::vector<StampedState> states,
                      const ImuBias& bias, const Eigen::MatrixXd& claimed_covariance,
                      double gravity_mps2, const Truth& truth) {
  StageRecord stage = StageRecord::fromStates(name, std::move(states), bias, gravity_mps2);
  WindowErrors errors =
      evaluateWindow(stage.states, bias, truth.ground_truth, truth.gravity_direction_G);
  setNees(stage.states, bias, truth.ground_truth, claimed_covariance, &errors);
  if (errors.keyframes > 0) stage.errors = errors;
  return stage;
}

}  // namespace

AttemptRecord makeAttemptRecord(const InitializationAttempt& attempt, double gravity_mps2,
                                const GroundTruth& ground_truth,
                                const std::optional<Eigen::Vector3d>& gravity_direction_G) {
  const Truth truth{ground_truth, gravity_direction_G};
  AttemptRecord record;
  record.t = attempt.t;
  record.initializer = attempt.initializer;
  record.keyframes = attempt.keyframes;
  if (attempt.accepted()) {
    record.status = kStatusSuccess;
  } else {
    const Refusal& refusal = attempt.decision.error();
    record.status = toString(refusal.status);
    record.reason = refusal.reason;
    record.reason_value = refusal.value.value_or(WindowErrors::kNone);
    record.reason_bound = refusal.bound.value_or(WindowErrors::kNone);
  }

  if (attempt.used_stereo_odometry)
    record.timings.push_back({kTimingStereoOdometry, attempt.stereo_odometry_ms});
  record.timings.push_back({kTimingInitialize, attempt.initialize_ms});
  // Of attempts that grew, an earlier one may have had it.
  if (attempt.has_vi_ba || attempt.vi_ba_ms > 0.0)
    record.timings.push_back({kTimingViBa, attempt.vi_ba_ms});
  for (const StageTiming& timing : attempt.init_timings) record.timings.push_back(timing);

  record.extrinsics = attempt.extrinsics;
  record.time_offset = attempt.time_offset;
  record.time_offset_used_s = attempt.time_offset_used_s;
  if (attempt.init) {
    StageRecord stage = makeStage(kStageInit, attempt.init->states, attempt.init->bias,
                                  attempt.init->covariance, gravity_mps2, truth);
    if (attempt.init->covariance.size() > 0) {
      stage.covariance = attempt.init->covariance;
      stage.covariance_order = kInitCovarianceOrder;
    }
    record.stages.push_back(std::move(stage));
  }
  if (attempt.has_vi_ba && attempt.vi_ba.states.size() == attempt.keyframes.size()) {
    std::vector<StampedState> states;
    for (size_t k = 0; k < attempt.keyframes.size(); ++k)
      states.emplace_back(attempt.keyframes[k], attempt.vi_ba.states[k]);
    StageRecord stage = makeStage(kStageViBa, std::move(states), attempt.vi_ba.bias,
                                  claimedCovariance(attempt.vi_ba), gravity_mps2, truth);
    if (attempt.vi_ba.covariance.size() > 0) {
      stage.covariance = attempt.vi_ba.covariance;
      stage.covariance_order = kViBaCovarianceOrder;
    }
    record.stages.push_back(std::move(stage));
  }
  return record;
}

}  // namespace etalon
