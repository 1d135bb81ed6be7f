#include <cstdio>

#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/gravity_alignment.h"
#include "etalon/initialization/inertial_only_step.h"
#include "etalon/initialization/initializer.h"
#include "etalon/optimization/linear_alignment.h"
#include "etalon/optimization/starting_landmarks.h"
#include "etalon/optimization/translation_ba.h"

namespace etalon::plugins {

/**
 * ETA (Song et al.): the inertial-only MAP, then rotations from the gyro with its bias removed and
 * a 3-DoF bundle adjustment of the translations, then velocities and gravity anew (README.md beside
 * this file).
 */
class Eta : public Initializer {
  DEFINE_MRPT_OBJECT(Eta, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    map_.declare(parameters);
    parameters.add("landmarks", &landmarks_, {"fixed", "free"},
                   "Landmarks in the 3-DoF bundle adjustment: fixed at stereo odometry's (the "
                   "paper), or free to move.");
    parameters.add("rounds", &translation_.rounds, {1, 100},
                   "Rounds of the 3-DoF bundle adjustment; outliers are relabelled between them, "
                   "the last has no robust kernel.");
    parameters.add("iterations_per_round", &translation_.iterations_per_round, {1, 1000},
                   "Gauss-Newton iterations of a round, at most.");
    parameters.add("chi2_pixel", &translation_.chi2_threshold, {0.1, 1e9},
                   "Squared Huber width and outlier threshold of a pixel (2 degrees of freedom, 95 "
                   "%: 5.991).");
    parameters.add("min_inliers", &min_inliers_, {3, 100000},
                   "Refuse if fewer measurements of a keyframe agree with its translation.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const VisualSolution& visual = problem.visualSolution();
    Stopwatch watch;
    const InertialOnlyStep step = solveInertialOnlyStep(problem, map_);
    if (!step.ok) return step.refusal;
    const double map_ms = watch.lapMilliseconds();

    std::vector<SE3> T_VB = visual.T_VB;
    for (size_t k = 1; k < T_VB.size(); ++k)
      T_VB[k].R = T_VB[k - 1].R * step.preintegrations[k - 1].corrected(step.map.bias).dR;
    VisualFrameEstimate estimate;
    estimate.bias = step.map.bias;
    InitializationResult refusal = estimateTranslations(problem, visual, T_VB, &estimate);
    if (!refusal.reason.empty()) return refusal;
    const double translation_ms = watch.lapMilliseconds();

    const LinearAlignmentResult alignment =
        alignVelocitiesAndGravity(estimate.T_VB, step.preintegrations, step.map.bias,
                                  problem.gravityMagnitude(), step.map.g_V);
    if (!alignment.ok)
      return InitializationResult::refusal(InitializationStatus::kIllConditioned,
                                           "velocities and gravity are not determined by the "
                                           "translations found",
                                           0.0);
    estimate.v_VB = alignment.v_VB;
    estimate.g_V = alignment.g_V;
    InitializationResult result = alignWithGravity(problem, estimate);
    result.timings = {{"inertial_only_map", map_ms},
                      {"translation_ba", translation_ms},
                      {"linear_alignment", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** Fills poses and landmarks of `estimate`; the refusal's reason is empty on success. */
  InitializationResult estimateTranslations(const InitializationProblem& problem,
                                            const VisualSolution& visual,
                                            const std::vector<SE3>& T_VB,
                                            VisualFrameEstimate* estimate) const {
    const VisualWindow window =
        buildVisualWindow(problem.calibration(), problem.keyframes(), problem.sigmaPx());
    const StartingLandmarks start = startingLandmarks(window, visual.landmarks);
    TranslationBaOptions options = translation_;
    options.landmarks_free = landmarks_ == "free";
    const TranslationBaResult ba =
        solveTranslationBa(window, T_VB, start.positions, start.valid, options);
    if (!ba.ok || ba.fewest_inliers < min_inliers_) {
      char text[160];
      std::snprintf(text, sizeof(text),
                    "%d measurements agree with the translation of the weakest keyframe, at least "
                    "%d are wanted",
                    ba.fewest_inliers, min_inliers_);
      return InitializationResult::refusal(InitializationStatus::kTooFewTracks, text,
                                           ba.fewest_inliers);
    }
    estimate->T_VB = ba.T_VB;
    for (size_t l = 0; l < window.landmark_ids.size(); ++l)
      if (start.valid[l]) estimate->landmarks[window.landmark_ids[l]] = ba.landmarks[l];
    return {};
  }

  InertialOnlyStepOptions map_;
  TranslationBaOptions translation_;
  std::string landmarks_ = "fixed";
  int min_inliers_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(Eta, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(Eta, etalon::plugins, "eta", "1.0",
                            "inertial-only MAP, gyro rotations, 3-DoF BA of the translations (ETA)")
