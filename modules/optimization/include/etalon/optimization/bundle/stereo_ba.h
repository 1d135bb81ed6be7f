#pragma once

#include <vector>

#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

struct StereoBaOptions {
  int rounds = 2;  ///< optimise, relabel outliers, optimise again
  int iterations_per_round = 10;
  double chi2_threshold = kChi2Pixel;  ///< of a pixel; its root is the Huber width
  bool compute_covariance = false;
};

struct StereoBaResult {
  SolverSummary summary;
  std::vector<SE3> T_VB;
  BundleProblem bundle;            ///< as given, landmarks and inliers solved
  double rms_px_over_sigma = 0.0;  ///< whitened RMS of the inliers, per coordinate
  Eigen::MatrixXd covariance;      ///< as VisualSolution::covariance
};

/**
 * Bundle adjustment of all poses but the first (fixed) and all known landmarks. Ceres,
 * Levenberg-Marquardt with a dense Schur complement, one thread, bit-identical from run to run.
 */
StereoBaResult solveStereoBa(BundleProblem bundle, const std::vector<SE3>& T_VB,
                             const StereoBaOptions& options = {});

}  // namespace etalon
