#include "etalon/optimization/bundle/visual_inertial_ba.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "bundle/noise_check.h"
#include "bundle/visual_inertial_system.h"
#include "residuals/reprojection_cost.h"

namespace etalon {

void VisualInertialBaOptions::declare(ParameterSet& parameters) {
  parameters.add("rounds", &rounds, {1, 10},
                 "Rounds of optimisation; between two, outliers are relabelled, the sizes of the "
                 "errors follow the residuals, and the IMU is re-integrated where the bias moved "
                 "far.");
  parameters.add("iterations_per_round", &iterations_per_round, {1, 200},
                 "Gauss-Newton steps per round, at most.");
  parameters.add(
      "converged_sigmas", &converged_sigmas, {1e-6, 10.0},
      "The last round ends where a step of all states together is shorter than this many "
      "of its own standard deviations, those before it at 1; what did not get there has "
      "not converged.");
  parameters.add(
      "chi2_inertial", &chi2_inertial, {0.1, 1e9},
      "Squared Huber width of an inertial residual (9 degrees of freedom, 95 %: 16.92).");
  parameters.add(
      "chi2_pixel", &chi2_pixel, {0.1, 1e9},
      "Squared Huber width of a pixel, and the threshold above which it is an outlier (2 "
      "degrees of freedom, 95 %: 5.991).");
  parameters.add("least_pixel_share", &least_pixel_share, {1e-3, 1.0},
                 "Least share of sigma_px that counts as the pixels' noise where the window's own "
                 "residuals show less; 1: sigma_px as it is.");
  parameters.add("sigma_shared_deg", &sigma_shared_deg, {1e-4, 10.0},
                 "Standard deviation of the error that all pixels of a keyframe share, as a "
                 "rotation per axis, deg (calibration; 0.01 deg is 0.08 px at 460 px of focal "
                 "length). 1e-4: practically none.");
  parameters.add("sigma_turn_deg", &sigma_turn_deg, {1e-4, 10.0},
                 "Standard deviation of the turn of the cameras in the body against the "
                 "calibration, per axis, deg. 1e-4: practically none.");
  parameters.add("reintegrate_gyro_rps", &reintegrate_gyro_rps, {0.0, 10.0},
                 "Re-integrate the raw IMU if b_g moved farther than this, rad/s.");
  parameters.add("reintegrate_accel_mps2", &reintegrate_accel_mps2, {0.0, 100.0},
                 "Re-integrate the raw IMU if b_a moved farther than this, m/s^2.");
}

namespace {

/** Gauss-Newton, damped (Levenberg-Marquardt) only where a plain step raises the cost. */
class VisualInertialSolver {
 public:
  /** Problem and options must outlive this; it keeps the inliers and landmarks up to date. */
  VisualInertialSolver(VisualInertialProblem* problem, const VisualInertialBaOptions& options)
      : problem_(*problem), options_(options), system_(*problem, options), now_(system_.start()) {}

  /** One round, ended by a step shorter than `converged_sigmas`. */
  void solve(double converged_sigmas, VisualInertialBaResult* result) {
    reintegrate();
    SolverSummary& summary = result->summary;
    system_.linearizePixels(&now_);
    if (summary.iterations > 0) followSizes();
    StepEquations equations = system_.equations(system_.residuals(now_));
    if (summary.iterations == 0) summary.initial_cost = equations.cost;
    summary.termination = Termination::kMaxIterations;
    double damping = 0.0;
    for (int i = 0; i < options_.iterations_per_round && !summary.converged(); ++i) {
      ++summary.iterations;
      const Eigen::VectorXd step = stepOf(equations, damping);
      // Twice the decrease, which is the squared length of the step of everything in its sigmas.
      const double promised = equations.promised - step.dot(equations.g);
      const bool plain = damping == 0.0 && promised >= 0.0;
      if (plain) result->last_step_sigmas = std::sqrt(promised);
      if (plain && result->last_step_sigmas < converged_sigmas) {
        now_ = system_.moved(now_, step);
        equations.cost -= 0.5 * promised;
        summary.termination = Termination::kConverged;
      } else {
        take(step, &equations, &damping);
      }
    }
    summary.final_cost = equations.cost;
    if (!std::isfinite(summary.final_cost))
      summary.stop(Termination::kFailed, "the cost is not finite");
  }

  /** Stores the state; relabels by the pixels' noise as the window was built with, and counts. */
  void store(VisualInertialBaResult* result) {
    for (size_t k = 0; k < now_.T_WB.size(); ++k)
      result->states[k] = {now_.T_WB[k], now_.v_WB[k], now_.bias};
    result->bias = now_.bias;
    result->pixel_share = system_.pixelShare();
    now_.landmarks.store(&problem_.bundle);
    relabel(1.0);
    result->inlier_measurements = problem_.bundle.inlierCount();
  }

  /** Takes the pixels' noise for what the inliers show. */
  void followPixels() {
    system_.setPixelShare(
        std::clamp(problem_.bundle.trimmedNoise(now_.seen()), options_.least_pixel_share, 1.0));
  }

  /** Relabels by the pixels' noise as it is known. */
  void relabel() { relabel(system_.pixelShare()); }

  /** Counts of the residuals; with covariance also what the normal equations say. */
  void statistics(VisualInertialBaResult* result) {
    const BundleProblem& bundle = problem_.bundle;
    now_.landmarks.holdAtInfinity(bundle.window, now_.seen());
    const BiasPriors& priors = problem_.priors;
    result->gyro_bias_sigmas = (now_.bias.gyro - priors.mean.gyro).norm() / priors.sigma_gyro_rps;
    result->accel_bias_sigmas =
        (now_.bias.accel - priors.mean.accel).norm() / priors.sigma_accel_mps2;
    int landmark_unknowns = 0;
    for (size_t l = 0; l < bundle.landmarks.size(); ++l)
      if (bundle.landmarks[l].valid) landmark_unknowns += now_.landmarks.held[l] ? 2 : 3;
    for (const VisualMeasurement& m : bundle.window.measurements)
      result->measurements += bundle.landmarks[m.landmark].known;
    if (!options_.compute_covariance) return;
    const std::vector<LinearizedResidual> residuals = system_.residuals(now_);
    const NormalEquations visual = system_.visualEquations(now_);
    const double share = 1.0 / truncationFactor(options_.chi2_pixel, options_.rounds);
    const NormalEquations told = system_.normalEquations(visual, share, residuals);
    const Eigen::MatrixXd covariance = covarianceOrEmpty(told.curvature, told.score);
    const Eigen::Index states = system_.turnColumn();
    if (covariance.size() > 0) result->covariance = covariance.topLeftCorner(states, states);
    if (!options_.check_noise || result->covariance.size() == 0) return;
    const NormalEquations fit = system_.normalEquations(visual, 1.0, residuals);
    const Eigen::MatrixXd inverse = inverseOrEmpty(fit.score);
    if (inverse.size() == 0) return;
    result->noise = checkNoise({bundle.window, now_.seen(), bundle.landmarks, landmark_unknowns,
                                options_.chi2_pixel, system_.pixelShare()},
                               residuals, inverse);
  }

 private:
  /** Takes the sizes of the accelerometer's errors where the window's own residuals want them; the pixels are
   * linearised. */
  void followSizes() {
    if (system_.slowCount() == 0) return;
    const std::vector<LinearizedResidual> residuals = system_.residuals(now_);
    const Eigen::MatrixXd P = inverseOrEmpty(system_.equations(residuals).H);
    if (P.size() == 0) return;
    const AccelErrorSizes before = system_.sizes();
    system_.setSizes(scoredSizes(before, residuals, P, now_.slow, system_.slowColumn(),
                                 problem_.priors.slow_accel));
    now_.slow *= before.slow / system_.sizes().slow;
  }

  static constexpr double kLeastDamping = 1e-6;  ///< of the diagonal
  /** Half the square of a twentieth of a standard deviation: where inverse depths that the views do
   * not tell are kept, the last steps do not lower the cost. */
  static constexpr double kNegligible = 1.25e-3;

  /** Not finite if the equations are not positive definite. */
  static Eigen::VectorXd stepOf(const StepEquations& equations, double damping) {
    // Scaled to a unit diagonal: the unknowns' units differ by many orders of magnitude.
    const Eigen::VectorXd scale = equations.H.diagonal().cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd scaled = scale.asDiagonal() * equations.H * scale.asDiagonal();
    scaled.diagonal().array() += damping;
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(scaled);
    if (factor.info() != Eigen::Success)
      return Eigen::VectorXd::Constant(scale.size(), std::numeric_limits<double>::quiet_NaN());
    return -scale.cwiseProduct(factor.solve(Eigen::VectorXd(scale.cwiseProduct(equations.g))));
  }

  /** Takes a step if it does not raise the cost; sets the damping, and the equations for the next step. */
  void take(const Eigen::VectorXd& step, StepEquations* equations, double* damping) {
    if (step.allFinite()) {
      const double less = *damping > kLeastDamping ? 0.1 * *damping : 0.0;
      VisualInertialUnknowns next = system_.moved(now_, step);
      StepEquations there = system_.linearize(&next, less);
      if (there.cost <= equations->cost + kNegligible) {
        now_ = std::move(next);
        *equations = std::move(there);
        *damping = less;
        return;
      }
    }
    *damping = std::max(kLeastDamping, 10.0 * *damping);
    *equations = system_.linearize(&now_, *damping);
  }

  void relabel(double pixel_share) {
    problem_.bundle.relabel(now_.seen(), options_.chi2_pixel * pixel_share * pixel_share);
  }

  void reintegrate() {
    for (Preintegration& p : problem_.preintegrations)
      if ((p.bias().gyro - now_.bias.gyro).norm() > options_.reintegrate_gyro_rps ||
          (p.bias().accel - now_.bias.accel).norm() > options_.reintegrate_accel_mps2)
        p = p.reintegrated(now_.bias);
  }

  VisualInertialProblem& problem_;
  const VisualInertialBaOptions& options_;
  VisualInertialSystem system_;
  VisualInertialUnknowns now_;
};

}  // namespace

VisualInertialBaResult solveVisualInertialBa(VisualInertialProblem problem,
                                             const VisualInertialBaOptions& options) {
  VisualInertialBaResult result;
  result.states = problem.states;
  result.bias = problem.bias;
  const auto finish = [&] {
    result.bundle = std::move(problem.bundle);
    return std::move(result);
  };
  std::vector<SE3> T_WB;
  for (const NavState& s : problem.states) T_WB.push_back(s.T_WB);
  // First round: all but gross outliers (30 sigma), the kernel does the rest.
  problem.bundle.relabel(T_WB, kGrossOutlier * kGrossOutlier);
  if (problem.bundle.inlierCount() == 0) {
    result.summary.stop(Termination::kNotStarted, "no landmark agrees with the initial poses");
    return finish();
  }
  VisualInertialSolver solver(&problem, options);
  // Outliers are relabelled after these rounds, so their minimum need not be exact.
  const double first_rounds = std::max(1.0, options.converged_sigmas);
  for (int round = 0; round < options.rounds; ++round) {
    const bool last = round + 1 == options.rounds;
    solver.solve(last ? options.converged_sigmas : first_rounds, &result);
    if (!result.summary.usable()) return finish();
    solver.store(&result);
    if (!last) solver.followPixels();
    solver.relabel();
    if (problem.bundle.inlierCount() == 0) {
      result.summary.stop(Termination::kFailed, "every measurement became an outlier");
      return finish();
    }
  }
  solver.statistics(&result);
  return finish();
}

}  // namespace etalon
