#pragma once

#include <functional>
#include <vector>

#include "etalon/imu/bias_priors.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/residuals/inertial_residual.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

struct TrajectoryBaOptions {
  int rounds = 4;  ///< optimise, relabel outliers, follow the pixels' noise, optimise again
  int iterations_per_round = 8;
  int last_iterations = 50;  ///< of the last round, which goes on until it converges
  /** Squared whitened distance beyond which a pixel is left out after the first round. */
  double chi2_outlier = 8.0;
  /** The pixels' standard deviation follows the residuals' median, but not below this share of the
   * one that the window was built with. */
  double least_noise_factor = 0.3;
  /** Called after each iteration with their number so far. Once it returns false the solver stops
   * (Termination::kStopped). Empty: it always goes on. */
  std::function<bool(int iterations)> go_on;
};

/** What it is solved on. W is gravity-aligned. */
struct TrajectoryBaProblem {
  BundleProblem bundle;  ///< landmarks in W; those without position are found
  std::vector<Preintegration> preintegrations;  ///< between neighbouring states
  std::vector<NavState> states;  ///< the start, one a keyframe of the bundle's window
  BiasPriors priors;             ///< of the first state's biases
  double gravity_mps2 = 9.81;
};

struct TrajectoryBaResult {
  SolverSummary summary;
  std::vector<NavState> states;
  BundleProblem bundle;       ///< as given, landmarks and inliers solved
  double noise_factor = 1.0;  ///< the pixels' standard deviation over the one believed
};

/**
 * Visual-inertial bundle adjustment over a whole trajectory: every keyframe with pose, velocity and
 * biases, whose walk is in the inertial residual (inertial_residual.h), and all landmarks. Pixels
 * have a Cauchy loss. Gauge: position and yaw of the first keyframe. Ceres, Levenberg-Marquardt,
 * sparse Schur complement, one thread, bit-identical from run to run.
 */
TrajectoryBaResult solveTrajectoryBa(TrajectoryBaProblem problem,
                                     const TrajectoryBaOptions& options = {});

}  // namespace etalon
