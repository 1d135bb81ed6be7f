#include "etalon/optimization/bundle/stereo_ba.h"

#include <algorithm>
#include <cmath>

#include "bundle/schur.h"
#include "bundle/visual_problem.h"

namespace etalon {

namespace {

/**
 * Variance of the estimate over what the information of the inliers alone says, for residuals as
 * normal as sigma_px promises. Leaving out those beyond `chi2` costs more than their number,
 * because an estimate moves the selection along with itself.
 *
 * Per unit of information, with psi the sum of the residuals kept and r that of all of them, the
 * error is e = r after the first round (Huber's loss costs less than one percent). Each further
 * round selects by the last estimate:  e' = (psi + (p - s) e) / p.
 *
 * Here p is the share kept and s = E[psi^2]; for two dimensions, with q = exp(-chi2 / 2),
 * p = 1 - q and s = 1 - q (1 + chi2 / 2). For two rounds the result is 1.12.
 */
double truncationFactor(double chi2, int rounds) {
  const double s = 1.0 - std::exp(-0.5 * chi2) * (1.0 + 0.5 * chi2);
  const double p = 1.0 - std::exp(-0.5 * chi2);
  double of_psi = 0.0, of_r = 1.0;  // e = of_psi psi + of_r r
  for (int round = 1; round < rounds; ++round) {
    of_psi = (1.0 + (p - s) * of_psi) / p;
    of_r = (p - s) * of_r / p;
  }
  return p * (s * of_psi * (of_psi + 2.0 * of_r) + of_r * of_r);
}

}  // namespace

StereoBaResult solveStereoBa(const VisualWindow& window, const std::vector<SE3>& T_VB,
                             const std::vector<Eigen::Vector3d>& landmarks,
                             const std::vector<char>& landmark_valid,
                             const StereoBaOptions& options) {
  StereoBaResult result;
  result.landmark_valid = landmark_valid;
  result.T_VB = T_VB;
  result.landmarks = landmarks;
  // First round: all but gross outliers (30 sigma), the kernel does the rest.
  double sum = relabelMeasurements(window, T_VB, landmarks, kGrossOutlier * kGrossOutlier,
                                   &result.landmark_valid, &result.inlier);
  if (std::count(result.inlier.begin(), result.inlier.end(), 1) == 0) return result;
  VisualProblem visual(window, T_VB, landmarks);
  for (int round = 0; round < options.rounds; ++round) {
    const auto problem = visual.makeProblem(result.inlier, options.chi2_threshold);
    problem->SetParameterBlockConstant(visual.pose(0));
    ceres::Solver::Summary summary;
    ceres::Solve(visual.solverOptions(*problem, {}, options.iterations_per_round), problem.get(),
                 &summary);
    result.iterations += static_cast<int>(summary.iterations.size());
    result.T_VB = visual.poses();
    result.landmarks = visual.positions();
    result.landmark_valid = landmark_valid;
    sum = relabelMeasurements(window, result.T_VB, result.landmarks, options.chi2_threshold,
                              &result.landmark_valid, &result.inlier);
    if (std::count(result.inlier.begin(), result.inlier.end(), 1) == 0) return result;
  }
  const auto inliers = std::count(result.inlier.begin(), result.inlier.end(), 1);
  result.rms_px_over_sigma = std::sqrt(sum / (2.0 * static_cast<double>(inliers)));
  if (options.compute_covariance && window.keyframe_count > 1) {
    const Eigen::Index n = 6 * window.keyframe_count;
    NormalEquations equations(n);
    visual.holdAtInfinity(result.inlier);
    addReducedVisualInformation(window, result.T_VB, {visual.landmarks(), visual.held()},
                                result.inlier, options.chi2_threshold, 6, &equations);
    result.covariance = truncationFactor(options.chi2_threshold, options.rounds) *
                        covarianceOrEmpty(equations.curvature.bottomRightCorner(n - 6, n - 6),
                                          equations.score.bottomRightCorner(n - 6, n - 6));
  }
  return result;
}

}  // namespace etalon
