#include "etalon/optimization/bundle/stereo_ba.h"

#include <cmath>

#include "bundle/noise_check.h"
#include "bundle/visual_problem.h"
#include "etalon/optimization/bundle/reduced_information.h"

namespace etalon {

StereoBaResult solveStereoBa(BundleProblem bundle_to_solve, const std::vector<SE3>& T_VB,
                             const StereoBaOptions& options) {
  StereoBaResult result;
  result.bundle = std::move(bundle_to_solve);
  result.T_VB = T_VB;
  BundleProblem& bundle = result.bundle;
  const double huber = std::sqrt(options.chi2_threshold);
  // First round: all but gross outliers (30 sigma), the kernel does the rest.
  double sum = bundle.relabel(T_VB, kGrossOutlier * kGrossOutlier);
  if (bundle.inlierCount() == 0) {
    result.summary.stop(Termination::kNotStarted, "no landmark agrees with the initial poses");
    return result;
  }
  VisualProblem visual(bundle, T_VB);
  for (int round = 0; round < options.rounds; ++round) {
    const auto problem = visual.makeProblem(huber);
    problem->SetParameterBlockConstant(visual.pose(0));
    ceres::Solver::Summary run;
    ceres::Solve(visual.solverOptions(*problem, options.iterations_per_round), problem.get(), &run);
    addRun(run, &result.summary);
    if (!result.summary.usable()) return result;
    result.T_VB = visual.poses();
    visual.landmarks().store(&bundle);
    sum = bundle.relabel(result.T_VB, options.chi2_threshold);
    if (bundle.inlierCount() == 0) {
      result.summary.stop(Termination::kFailed, "every measurement became an outlier");
      return result;
    }
  }
  result.rms_px_over_sigma = std::sqrt(sum / (2.0 * bundle.inlierCount()));
  if (options.compute_covariance && bundle.window.keyframe_count > 1) {
    const Eigen::Index n = 6 * bundle.window.keyframe_count;
    NormalEquations equations(n);
    visual.holdAtInfinity();
    addReducedVisualInformation(bundle.window, result.T_VB,
                                {visual.landmarks().landmarks, visual.landmarks().held},
                                huberOfInliers(huber), &equations);
    result.covariance = truncationFactor(options.chi2_threshold, options.rounds) *
                        covarianceOrEmpty(equations.curvature.bottomRightCorner(n - 6, n - 6),
                                          equations.score.bottomRightCorner(n - 6, n - 6));
  }
  return result;
}

}  // namespace etalon
