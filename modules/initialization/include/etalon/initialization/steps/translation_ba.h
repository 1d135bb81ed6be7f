#pragma once

#include <vector>

#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

struct TranslationBaOptions {
  int rounds = 4;
  int iterations_per_round = 10;
  double chi2_threshold = kChi2Pixel;
  bool landmarks_free = false;  ///< landmarks move too
};

struct TranslationBaResult {
  bool ok = false;
  std::vector<SE3> T_VB;                   ///< rotations as given
  std::vector<Eigen::Vector3d> landmarks;  ///< moved where landmarks_free
  std::vector<char> inlier;                ///< one a measurement
  int inliers = 0;
  int fewest_inliers = 0;  ///< of a keyframe's measurements, the first apart
  int iterations = 0;
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
TranslationBaResult solveTranslationBa(const VisualWindow& window, const std::vector<SE3>& T_VB,
                                       const std::vector<Eigen::Vector3d>& landmarks,
                                       const std::vector<char>& landmark_valid,
                                       const TranslationBaOptions& options = {});

}  // namespace etalon
