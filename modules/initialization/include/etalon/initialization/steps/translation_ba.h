#pragma once

#include <vector>

#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

struct TranslationBaOptions {
  int rounds = 4;
  int iterations_per_round = 10;
  double chi2_threshold = kChi2Pixel;
  bool landmarks_free = false;  ///< landmarks move too
};

struct TranslationBaResult {
  SolverSummary summary;
  std::vector<SE3> T_VB;  ///< rotations as given
  /** As given; landmarks moved where landmarks_free, inliers of all known ones, `valid` untouched. */
  BundleProblem bundle;
  int inliers = 0;
  int fewest_inliers = 0;  ///< of a keyframe's measurements, the first apart
  double rms_px_over_sigma = 0.0;
  /** d(positions)/d(rotations) of keyframes 1.., at the pixels that the last round kept:
   * 3(N-1) x 3(N-1), right perturbation of the rotations, m/rad. */
  Eigen::MatrixXd position_by_rotation;
};

/**
 * 3-DoF bundle adjustment (Wang et al., ICRA 2024; step 3 of ETA): rotations fixed, the
 * translations of all keyframes but the first are found by Gauss-Newton with Huber weights,
 * `rounds` times `iterations_per_round`, chi-square relabelling between rounds, no kernel in the
 * last. With known rotations a residual depends on p_W - p_WB alone, so the derivative with respect
 * to a landmark is minus that of the translation, and the landmarks are eliminated in closed form.
 */
TranslationBaResult solveTranslationBa(BundleProblem bundle, const std::vector<SE3>& T_VB,
                                       const TranslationBaOptions& options = {});

}  // namespace etalon
