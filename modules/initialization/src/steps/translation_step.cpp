#include "etalon/initialization/steps/translation_step.h"

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon {

void TranslationStepOptions::declare(ParameterSet& parameters) {
  parameters.add("landmarks", &ba.landmarks_free, {{"fixed", false}, {"free", true}},
                 "Landmarks in the 3-DoF bundle adjustment: fixed at stereo odometry's (the "
                 "paper), or free to move.");
  parameters.add("rounds", &ba.rounds, {1, 100},
                 "Rounds of the 3-DoF bundle adjustment; outliers are relabelled between them, "
                 "the last has no robust kernel.");
  parameters.add("iterations_per_round", &ba.iterations_per_round, {1, 1000},
                 "Gauss-Newton iterations per round, at most.");
  parameters.add("chi2_pixel", &ba.chi2_threshold, {0.1, 1e9},
                 "Squared Huber width and outlier threshold of a pixel (2 degrees of freedom, 95 "
                 "%: 5.991).");
  parameters.add("min_inliers", &min_inliers, {3, 100000},
                 "Refuse if fewer measurements of a keyframe agree with its translation.");
}

std::vector<Eigen::Matrix3d> integrateRotations(const Eigen::Matrix3d& R_WB0,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias) {
  std::vector<Eigen::Matrix3d> R_WB{R_WB0};
  for (const Preintegration& p : preintegrations)
    R_WB.push_back(R_WB.back() * p.corrected(bias).dR);
  return R_WB;
}

Eigen::MatrixXd gyroPoseErrors(const std::vector<Preintegration>& preintegrations,
                               const Eigen::MatrixXd& position_by_rotation,
                               const StateErrors& errors) {
  using Eigen::Index;
  using Eigen::MatrixXd;
  const Index n = preintegrations.size();
  const MatrixXd imu = errors.sources.imu();
  MatrixXd poses = errors.sources.poses();
  MatrixXd moved(3 * n, poses.cols());  // from the rotations of the sources
  MatrixXd rotation = MatrixXd::Zero(3, poses.cols());
  for (Index k = 0; k < n; ++k) {
    const Preintegration& p = preintegrations[k];
    rotation = p.deltas().dR.transpose() * rotation + p.dR_dbg() * errors.map.topRows<3>() +
               imu.middleRows<3>(9 * k);
    moved.middleRows<3>(3 * k) = rotation - poses.middleRows<3>(6 * k);
    poses.middleRows<3>(6 * k) = rotation;
  }
  const MatrixXd positions = position_by_rotation * moved;
  for (Index k = 0; k < n; ++k) poses.middleRows<3>(6 * k + 3) += positions.middleRows<3>(3 * k);
  return poses;
}

namespace {

/** The 3-DoF bundle adjustment from the rotations of `T_VB`. */
Expected<TranslationBaResult> estimateTranslations(const InitializationProblem& problem,
                                                   const VisualSolution& visual,
                                                   const std::vector<SE3>& T_VB,
                                                   const TranslationStepOptions& options) {
  BundleProblem start(
      buildVisualWindow(problem.calibration(), problem.keyframes(), problem.sigmaPx()),
      visual.landmarks);
  TranslationBaResult ba = solveTranslationBa(std::move(start), T_VB, options.ba);
  if (!ba.summary.usable())
    return refuse(RefusalStatus::kIllConditioned, "the 3-DoF bundle adjustment failed after ",
                  Value(ba.summary.iterations), " iterations: ", ba.summary.message);
  if (ba.fewest_inliers < options.min_inliers)
    return refuse(RefusalStatus::kTooFewTracks, Value(ba.fewest_inliers),
                  " measurements agree with the translation of the weakest keyframe, at least ",
                  Bound(options.min_inliers), " are wanted");
  return ba;
}

std::map<LandmarkId, Eigen::Vector3d> knownLandmarks(const BundleProblem& bundle) {
  std::map<LandmarkId, Eigen::Vector3d> result;
  for (size_t l = 0; l < bundle.landmarks.size(); ++l)
    if (bundle.landmarks[l].known)
      result[bundle.window.landmark_ids[l]] = bundle.landmarks[l].position;
  return result;
}

}  // namespace

Expected<TranslationStep> solveTranslationStep(const InitializationProblem& problem,
                                               const std::vector<Preintegration>& preintegrations,
                                               const ImuBias& bias, const Eigen::Vector3d& g_V_seed,
                                               const TranslationStepOptions& options,
                                               const std::optional<StateErrors>& bias_errors) {
  const Expected<VisualSolution>& visual = problem.visualSolution();
  if (!visual) return refuse(visual.error());
  Stopwatch watch;
  std::vector<SE3> T_VB = visual->T_VB;
  const std::vector<Eigen::Matrix3d> rotations =
      integrateRotations(T_VB.front().R, preintegrations, bias);
  for (size_t k = 1; k < T_VB.size(); ++k) T_VB[k].R = rotations[k];

  const Expected<TranslationBaResult> ba = estimateTranslations(problem, *visual, T_VB, options);
  if (!ba) return refuse(ba.error());
  TranslationStep step;
  step.estimate.bias = bias;
  step.estimate.T_VB = ba->T_VB;
  step.estimate.landmarks = knownLandmarks(ba->bundle);
  step.translation_ms = watch.lapMilliseconds();

  const LinearAlignmentResult alignment = alignVelocitiesAndGravity(
      step.estimate.T_VB, preintegrations, bias, problem.gravityMagnitude(), g_V_seed);
  if (!alignment.summary.usable())
    return refuse(RefusalStatus::kIllConditioned,
                  "velocities and gravity are not determined by the translations found");
  step.estimate.v_VB = alignment.v_VB;
  step.estimate.g_V = alignment.g_V;
  if (bias_errors) {
    StateErrors errors = *bias_errors;
    errors.poses = gyroPoseErrors(preintegrations, ba->position_by_rotation, errors);
    if (alignErrors(step.estimate.T_VB, preintegrations, bias, {}, alignment.g_V, errors.poses,
                    &errors))
      step.estimate.errors = errors;
  }
  step.alignment_ms = watch.lapMilliseconds();
  return step;
}

}  // namespace etalon
