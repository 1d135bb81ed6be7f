#include "etalon/initialization/translation_step.h"

#include <cstdio>

#include "etalon/core/stopwatch.h"
#include "etalon/optimization/linear_alignment.h"
#include "etalon/optimization/starting_landmarks.h"

namespace etalon {

void TranslationStepOptions::declare(ParameterSet& parameters) {
  parameters.add("landmarks", &landmarks, {"fixed", "free"},
                 "Landmarks in the 3-DoF bundle adjustment: fixed at stereo odometry's (the "
                 "paper), or free to move.");
  parameters.add("rounds", &ba.rounds, {1, 100},
                 "Rounds of the 3-DoF bundle adjustment; outliers are relabelled between them, "
                 "the last has no robust kernel.");
  parameters.add("iterations_per_round", &ba.iterations_per_round, {1, 1000},
                 "Gauss-Newton iterations of a round, at most.");
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

namespace {

/** Fills poses and landmarks of `step->estimate`, or its refusal. */
bool estimateTranslations(const InitializationProblem& problem, const std::vector<SE3>& T_VB,
                          const TranslationStepOptions& options, TranslationStep* step) {
  const VisualWindow window =
      buildVisualWindow(problem.calibration(), problem.keyframes(), problem.sigmaPx());
  const StartingLandmarks start = startingLandmarks(window, problem.visualSolution().landmarks);
  TranslationBaOptions ba_options = options.ba;
  ba_options.landmarks_free = options.landmarks == "free";
  const TranslationBaResult ba =
      solveTranslationBa(window, T_VB, start.positions, start.valid, ba_options);
  if (!ba.ok || ba.fewest_inliers < options.min_inliers) {
    char text[160];
    std::snprintf(text, sizeof(text),
                  "%d measurements agree with the translation of the weakest keyframe, at least "
                  "%d are wanted",
                  ba.fewest_inliers, options.min_inliers);
    step->refusal =
        InitializationResult::refusal(InitializationStatus::kTooFewTracks, text, ba.fewest_inliers);
    return false;
  }
  step->estimate.T_VB = ba.T_VB;
  for (size_t l = 0; l < window.landmark_ids.size(); ++l)
    if (start.valid[l]) step->estimate.landmarks[window.landmark_ids[l]] = ba.landmarks[l];
  return true;
}

}  // namespace

TranslationStep solveTranslationStep(const InitializationProblem& problem,
                                     const std::vector<Preintegration>& preintegrations,
                                     const ImuBias& bias, const Eigen::Vector3d& g_V_seed,
                                     const TranslationStepOptions& options) {
  Stopwatch watch;
  std::vector<SE3> T_VB = problem.visualSolution().T_VB;
  const std::vector<Eigen::Matrix3d> rotations =
      integrateRotations(T_VB.front().R, preintegrations, bias);
  for (size_t k = 1; k < T_VB.size(); ++k) T_VB[k].R = rotations[k];

  TranslationStep step;
  step.estimate.bias = bias;
  if (!estimateTranslations(problem, T_VB, options, &step)) return step;
  step.translation_ms = watch.lapMilliseconds();

  const LinearAlignmentResult alignment = alignVelocitiesAndGravity(
      step.estimate.T_VB, preintegrations, bias, problem.gravityMagnitude(), g_V_seed);
  if (!alignment.ok) {
    step.refusal = InitializationResult::refusal(
        InitializationStatus::kIllConditioned,
        "velocities and gravity are not determined by the translations found", 0.0);
    return step;
  }
  step.estimate.v_VB = alignment.v_VB;
  step.estimate.g_V = alignment.g_V;
  step.alignment_ms = watch.lapMilliseconds();
  step.ok = true;
  return step;
}

}  // namespace etalon
