#pragma once

#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

/** How to solve it. Section [vi_ba]. */
struct VisualInertialBaOptions {
  /** Optimise, relabel outliers, judge the sizes of the errors and re-integrate, optimise again. */
  int rounds = 3;
  int iterations_per_round = 50;
  /** Converged is what stopped, in the last round, by a Gauss-Newton step shorter than this in its
   * own sigmas. The rounds before end at one sigma, because outliers are relabelled after them. */
  double converged_sigmas = 0.1;
  double chi2_inertial = 16.92;    ///< 95 %, 9 degrees of freedom; its root is the Huber width
  double chi2_pixel = kChi2Pixel;  ///< the same of a pixel; those above it are outliers
  /** Where the residuals of a round show pixels less noisy than the window was built with, the next
   * round believes them; but not below this share. */
  double least_pixel_share = 0.1;
  /** Of the error that all pixels of a keyframe share, as a rotation an axis. Without it any number
   * of pixels would average out to nothing, and overrule the gyro. */
  double sigma_shared_deg = 0.025;
  double sigma_turn_deg = 0.05;         ///< of the turn of the cameras in the body, an axis
  double reintegrate_gyro_rps = 0.01;   ///< re-integrate the raw samples if b_g moved farther
  double reintegrate_accel_mps2 = 0.1;  ///< the same for b_a
  bool compute_covariance = true;
  /** Whether VisualInertialBaResult::noise is wanted; it needs the covariance. */
  bool check_noise = false;

  void declare(ParameterSet& parameters);
};

/** What it is solved on. W is gravity-aligned. */
struct VisualInertialProblem {
  BundleProblem bundle;                         ///< landmarks in W
  std::vector<Preintegration> preintegrations;  ///< between neighbouring keyframes
  std::vector<NavState> states;                 ///< the start, one a keyframe
  ImuBias bias;                                 ///< the start, of all keyframes
  BiasPriors priors;
  double gravity_mps2 = 9.81;
};

struct VisualInertialBaResult {
  /** Converged is a last_step_sigmas below VisualInertialBaOptions::converged_sigmas. */
  SolverSummary summary;
  /** Length of the last undamped step of all unknowns together, landmarks too, by the inverse
   * covariance: the root of twice the decrease that it promised. */
  double last_step_sigmas = 0.0;
  std::vector<NavState> states;
  ImuBias bias;              ///< of all keyframes, and in every state
  BundleProblem bundle;      ///< as given, landmarks and inliers solved
  double pixel_share = 1.0;  ///< standard deviation of the pixels over that of the window
  int inlier_measurements = 0;
  int measurements = 0;  ///< of landmarks that have a position, inliers or not
  /** Distance of a bias from its prior's mean in the prior's standard deviations. */
  double gyro_bias_sigmas = 0.0, accel_bias_sigmas = 0.0;
  /** Residuals against their expectation; zero without covariance or if it was not asked for. */
  NoiseCheck noise;
  /**
   * Covariance of every keyframe's [rotation, position, velocity] and then [b_g, b_a]: (9N+6)
   * square, gauge (position and yaw of the first keyframe) fixed. Far landmarks count for what they
   * tell and not for their noise (NormalEquations). Empty if not computed or if the data do
   * not determine the state.
   */
  Eigen::MatrixXd covariance;
};

/**
 * Visual-inertial bundle adjustment over a window: keyframe poses, velocities, one b_g, one b_a,
 * landmarks. Gauge: position and yaw of the first keyframe. Gauss-Newton with landmarks eliminated,
 * damped where a plain step does not lower the cost; one thread, bit-identical from run to run.
 */
VisualInertialBaResult solveVisualInertialBa(VisualInertialProblem problem,
                                             const VisualInertialBaOptions& options = {});

}  // namespace etalon
