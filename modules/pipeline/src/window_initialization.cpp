#include "etalon/pipeline/window_initialization.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/predicted_errors.h"
#include "etalon/initialization/steps/visual_inertial_problem.h"

namespace etalon {

std::vector<StampedState> InitializationAttempt::states() const {
  if (!has_vi_ba) return init ? init->states : std::vector<StampedState>();
  std::vector<StampedState> states;
  for (size_t k = 0; k < vi_ba.states.size(); ++k)
    states.emplace_back(keyframes[k], vi_ba.states[k]);
  return states;
}

std::vector<SE3> InitializationAttempt::poses() const {
  std::vector<SE3> poses;
  for (const StampedState& s : states()) poses.push_back(s.T_WB);
  return poses;
}

Eigen::MatrixXd InitializationAttempt::covariance() const {
  if (has_vi_ba) return claimedCovariance(vi_ba);
  if (!init || init->covariance.size() == 0) return {};
  return init->covariance.topLeftCorner<11, 11>();
}

void InitializationAttempt::dropEstimates() {
  if (init) init = refuse(decision.error());
  vi_ba = VisualInertialBaResult();
  landmarks.clear();
}

double InitializationAttempt::sigmaGyroBias() const {
  const Eigen::MatrixXd P = covariance();
  if (P.size() == 0) return std::numeric_limits<double>::infinity();
  return std::sqrt(std::max(0.0, P.diagonal().head<3>().maxCoeff()));
}

InitializationProblem makeProblem(const StereoInertialCalibration& calibration,
                                  const ImuNoiseDensities& noise, const WindowOptions& options,
                                  std::vector<TrackedFrame> frames,
                                  std::vector<int> keyframe_indices, ImuBuffer imu) {
  InitializationProblem::Data data;
  data.calibration = calibration;
  data.imu_noise = noise;
  data.gravity_mps2 = options.gravity_mps2;
  data.priors = options.priors;
  data.odometry = options.odometry;
  data.frames = std::move(frames);
  data.keyframe_indices = std::move(keyframe_indices);
  data.imu = std::move(imu);
  return InitializationProblem(std::move(data));
}

VisualInertialBaResult refine(const InitializationProblem& problem, const Initialization& start,
                              const WindowOptions& options,
                              std::map<LandmarkId, Eigen::Vector3d>* landmarks) {
  VisualInertialProblem vi = visualInertialProblem(problem, start);
  VisualInertialBaOptions vi_options = options.vi_ba;
  vi_options.check_noise = options.check_noise || options.acceptance.false_alarm_rate > 0.0;
  VisualInertialBaResult refined = solveVisualInertialBa(std::move(vi), vi_options);
  if (landmarks)
    for (const auto& [id, position] : refined.bundle.validLandmarks()) (*landmarks)[id] = position;
  return refined;
}

namespace {

/** Whether the window was refused because of the stamps of its images. */
void lookForTimeOffset(const InitializationProblem& problem, InitializationAttempt* attempt) {
  if (attempt->accepted()) return;
  Refusal& refusal = attempt->decision.error();
  if (refusal.status != RefusalStatus::kNotConverged &&
      refusal.status != RefusalStatus::kImplausible)
    return;
  const Expected<VisualSolution>& visual = problem.visualSolution();
  if (!visual) return;
  Expected<RotationTimeOffset> found = timeOffsetOfRotations(problem, *visual);
  if (!found || !found->certain()) return;
  found->offset_s += attempt->time_offset_used_s;
  refusal.reason += "; by the rotations of images and gyro " + found->inWords();
  attempt->time_offset = *found;
}

InitializationAttempt initializeAndJudge(const InitializationProblem& problem,
                                         const Initializer& initializer,
                                         const WindowOptions& options) {
  InitializationAttempt attempt;
  attempt.time_offset_used_s = options.time_offset_s;
  for (int k = 0; k < problem.keyframeCount(); ++k)
    attempt.keyframes.push_back(problem.keyframe(k).t);
  if (!attempt.keyframes.empty()) attempt.t = attempt.keyframes.back();

  // Another initializer may have asked for stereo odometry of the same problem before.
  const bool odometry_was_there = problem.visualSolutionComputed();
  Stopwatch watch;
  attempt.init = initializer.initialize(problem);
  attempt.initialize_ms = watch.lapMilliseconds();
  const bool odometry_is_there = problem.visualSolutionComputed();
  attempt.used_stereo_odometry =
      odometry_is_there && (!odometry_was_there || initializer.needsVisualSolution());
  if (attempt.used_stereo_odometry) {
    attempt.stereo_odometry_ms = problem.visualSolutionMilliseconds();
    if (!odometry_was_there) attempt.initialize_ms -= attempt.stereo_odometry_ms;
    const Expected<VisualSolution>& visual = problem.visualSolution();
    attempt.visual_rms_px = attempt.init && visual ? visual->rms_px : 0.0;
  }
  if (!attempt.init) {
    attempt.decision = refuse(attempt.init.error());
    return attempt;
  }
  attempt.init_timings = attempt.init->timings;
  if (const std::optional<SE3>& found = attempt.init->T_BC) {
    const SE3 step = found->inverse() * problem.calibration().cameras[0].T_BC;
    attempt.extrinsics = {*found, degrees(logSO3(step.R).norm()),
                          (found->t - problem.calibration().cameras[0].T_BC.t).norm()};
  }
  if (!options.refine) {
    attempt.decision = {};
    attempt.landmarks = attempt.init->landmarks;
    return attempt;
  }
  watch.lapMilliseconds();
  attempt.vi_ba = refine(problem, *attempt.init, options, &attempt.landmarks);
  attempt.vi_ba_ms = watch.lapMilliseconds();
  attempt.has_vi_ba = true;
  attempt.decision = judge(attempt.vi_ba, options.acceptance);
  return attempt;
}

}  // namespace

InitializationAttempt attemptInitialization(const InitializationProblem& problem,
                                            const Initializer& initializer,
                                            const WindowOptions& options) {
  InitializationAttempt attempt = initializeAndJudge(problem, initializer, options);
  lookForTimeOffset(problem, &attempt);
  return attempt;
}

}  // namespace etalon
