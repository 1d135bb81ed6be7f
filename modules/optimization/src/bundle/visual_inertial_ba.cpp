#include "etalon/optimization/bundle/visual_inertial_ba.h"

#include <ceres/normal_prior.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "bundle/noise_check.h"
#include "bundle/residual_list.h"
#include "bundle/slow_error.h"
#include "bundle/step_watch.h"
#include "bundle/visual_problem.h"
#include "etalon/core/angles.h"
#include "etalon/optimization/bundle/reduced_information.h"
#include "residuals/gauge_cost.h"
#include "residuals/preintegration_cost.h"
#include "residuals/shared_error_cost.h"

namespace etalon {

void VisualInertialBaOptions::declare(ParameterSet& parameters) {
  parameters.add("rounds", &rounds, {1, 10},
                 "Rounds of optimisation; between two, outliers are relabelled, the sizes of the "
                 "errors follow the residuals, and the IMU is re-integrated where the bias moved "
                 "far.");
  parameters.add("iterations_per_round", &iterations_per_round, {1, 200},
                 "Levenberg-Marquardt iterations of a round, at most.");
  parameters.add("converged_sigmas", &converged_sigmas, {1e-6, 10.0},
                 "Stop where a step of all states together is shorter than this many of its own "
                 "standard deviations; what did not get there has not converged.");
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
                 "rotation an axis, deg (calibration; 0.01 deg is 0.08 px at 460 px of focal "
                 "length). 1e-4: practically none.");
  parameters.add("sigma_turn_deg", &sigma_turn_deg, {1e-4, 10.0},
                 "Standard deviation of the turn of the cameras in the body against the "
                 "calibration, an axis, deg. 1e-4: practically none.");
  parameters.add("reintegrate_gyro_rps", &reintegrate_gyro_rps, {0.0, 10.0},
                 "Re-integrate the raw IMU if b_g moved farther than this, rad/s.");
  parameters.add("reintegrate_accel_mps2", &reintegrate_accel_mps2, {0.0, 100.0},
                 "Re-integrate the raw IMU if b_a moved farther than this, m/s^2.");
}

double VisualInertialBaResult::sigmaTilt() const {
  if (covariance.size() == 0) return std::numeric_limits<double>::infinity();
  // Rotation covariance of the first keyframe, from the body to the world, where tilt is about x
  // and y.
  const Eigen::Matrix3d R = states.front().T_WB.R;
  const Eigen::Matrix2d tilt =
      (R * covariance.topLeftCorner<3, 3>() * R.transpose()).topLeftCorner<2, 2>();
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(tilt).eigenvalues()(1)));
}

double VisualInertialBaResult::sigmaVelocity() const {
  if (covariance.size() == 0) return std::numeric_limits<double>::infinity();
  const Eigen::Index v = 9 * (states.size() - 1) + 6;
  return std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(v).maxCoeff()));
}

namespace {

/** State, residuals and solution of one visual-inertial BA. */
class VisualInertialSolver {
 public:
  /** Problem and options must outlive this; it keeps the inliers and landmarks up to date. */
  VisualInertialSolver(VisualInertialProblem* problem, const VisualInertialBaOptions& options)
      : problem_(*problem),
        options_(options),
        visual_(problem->bundle, poses(problem->states)),
        sigma_shared_rad_(radians(options.sigma_shared_deg)),
        sigma_turn_rad_(radians(options.sigma_turn_deg)),
        slow_modes_(slowErrorModes(problem->preintegrations, problem->priors.slow_accel)),
        slow_(Eigen::VectorXd::Zero(3 * slow_modes_.cols())),
        sizes_(slow_modes_.rows()) {
    for (const NavState& s : problem->states) {
      bodies_.push_back(toBlock(s.T_WB));
      velocities_.push_back(s.v_WB);
    }
    bias_ << problem->bias.gyro, problem->bias.accel;
    for (size_t k = 0; k < bodies_.size(); ++k) {
      state_.addPose(bodies_[k].data());
      state_.addVector(velocities_[k].data(), 3);
    }
    state_.addVector(bias_.data(), 6);
    state_.addVector(turn_.data(), 3);
    if (slow_.size() > 0) state_.addVector(slow_.data(), static_cast<int>(slow_.size()));
  }

  /** One Ceres run, ended by a step shorter than `converged_sigmas`. */
  void solve(double converged_sigmas, VisualInertialBaResult* result) {
    reintegrate();
    stateResiduals();
    const double variance = pixel_share_ * pixel_share_;
    const auto problem = visual_.makeProblem(std::make_unique<ceres::ScaledLoss>(
        new ceres::HuberLoss(std::sqrt(options_.chi2_pixel * variance)), 1.0 / variance,
        ceres::TAKE_OWNERSHIP));
    residuals_.addTo(problem.get(), state_);
    StepWatch watch(converged_sigmas);
    ceres::Solver::Options solver =
        visual_.solverOptions(*problem, state_, options_.iterations_per_round);
    solver.callbacks.push_back(&watch);
    solver.function_tolerance = 0.0;
    solver.initial_trust_region_radius = 10.0 * StepWatch::kUndamped;
    ceres::Solver::Summary run;
    ceres::Solve(solver, problem.get(), &run);
    // Ceres reports CONVERGENCE only where gradient or step are zero to rounding.
    addRun(run, &result->summary);
    result->last_step_sigmas = watch.lastStepSigmas();
  }

  /** Stores the state; relabels by the pixels' noise as the window was built with, and counts. */
  void store(VisualInertialBaResult* result) {
    for (size_t k = 0; k < bodies_.size(); ++k)
      result->states[k] = {fromBlock(bodies_[k].data()), velocities_[k], bias()};
    result->bias = bias();
    result->pixel_share = pixel_share_;
    visual_.storeLandmarks(&problem_.bundle);
    relabel(1.0);
    result->inlier_measurements = problem_.bundle.inlierCount();
  }

  /** Takes the pixels' noise for what the inliers show. */
  void followPixels() {
    pixel_share_ =
        std::clamp(problem_.bundle.trimmedNoise(visual_.poses()), options_.least_pixel_share, 1.0);
  }

  /** Relabels by the pixels' noise as it is known. */
  void relabel() { relabel(pixel_share_); }

  /** Takes the sizes of the accelerometer's errors where the window's own residuals want them. */
  void followSizes() {
    if (slow_.size() == 0) return;
    visual_.holdAtInfinity();
    const std::vector<LinearizedResidual> residuals = residuals_.linearize(state_);
    const Eigen::MatrixXd P = inverseOrEmpty(normalEquations(residuals).score);
    if (P.size() == 0) return;
    const AccelErrorSizes before = sizes_;
    sizes_ = scoredSizes(sizes_, residuals, P, slow_, state_.of(slow_.data()).column,
                         problem_.priors.slow_accel);
    slow_ *= before.slow / sizes_.slow;
  }

  /** Counts of the residuals; with covariance also what the normal equations say. */
  void statistics(VisualInertialBaResult* result) {
    visual_.holdAtInfinity();
    const BiasPriors& priors = problem_.priors;
    result->gyro_bias_sigmas = (bias().gyro - priors.mean.gyro).norm() / priors.sigma_gyro_rps;
    result->accel_bias_sigmas = (bias().accel - priors.mean.accel).norm() / priors.sigma_accel_mps2;
    const BundleProblem& bundle = problem_.bundle;
    int landmark_unknowns = 0;
    for (size_t l = 0; l < bundle.landmarks.size(); ++l)
      if (bundle.landmarks[l].valid) landmark_unknowns += visual_.held()[l] ? 2 : 3;
    result->measurements = bundle.window.measurements.size();
    if (!options_.compute_covariance) return;
    const std::vector<LinearizedResidual> residuals = residuals_.linearize(state_);
    const NormalEquations equations = normalEquations(residuals);
    const Eigen::MatrixXd covariance = covarianceOrEmpty(equations.curvature, equations.score);
    const Eigen::Index states = state_.of(turn_.data()).column;
    if (covariance.size() > 0) result->covariance = covariance.topLeftCorner(states, states);
    if (!options_.check_noise || result->covariance.size() == 0) return;
    const Eigen::MatrixXd inverse = inverseOrEmpty(equations.score);  // of the fit
    if (inverse.size() == 0) return;
    result->noise = checkNoise({bundle.window, visual_.poses(), bundle.landmarks, landmark_unknowns,
                                options_.chi2_pixel, pixel_share_},
                               residuals, inverse);
  }

 private:
  void relabel(double pixel_share) {
    problem_.bundle.relabel(visual_.poses(), options_.chi2_pixel * pixel_share * pixel_share);
  }

  /**
   * Every residual but the pixels', which visual_ holds: what solver, covariance and noise check
   * know of the problem. A new residual is one line here.
   */
  void stateResiduals() {
    residuals_.clear();
    for (size_t k = 0; k < bodies_.size(); ++k)
      residuals_.add({std::make_unique<SharedErrorCost>(sigma_shared_rad_),
                      {bodies_[k].data(), visual_.pose(k), turn_.data()},
                      ResidualKind::kEliminated});
    const Eigen::Vector3d g_W(0.0, 0.0, -problem_.gravity_mps2);
    const Eigen::VectorXd white = sizes_.whiteByInterval();
    for (size_t k = 0; k < problem_.preintegrations.size(); ++k) {
      ResidualBlock inertial{
          std::make_unique<PreintegrationCost>(problem_.preintegrations[k], g_W,
                                               sizes_.slow * slow_modes_.row(k), white[k]),
          {bodies_[k].data(), velocities_[k].data(), bodies_[k + 1].data(),
           velocities_[k + 1].data(), bias_.data()},
          ResidualKind::kImu,
          std::sqrt(options_.chi2_inertial)};
      if (slow_.size() > 0) inertial.parameters.push_back(slow_.data());
      residuals_.add(std::move(inertial));
    }
    const BiasPriors& priors = problem_.priors;
    Eigen::VectorXd mean(6), sigma(6);
    mean << priors.mean.gyro, priors.mean.accel;
    sigma << Eigen::Vector3d::Constant(priors.sigma_gyro_rps),
        Eigen::Vector3d::Constant(priors.sigma_accel_mps2);
    addPrior(mean, sigma, bias_.data());
    addPrior(Eigen::VectorXd::Zero(3), Eigen::VectorXd::Constant(3, sigma_turn_rad_), turn_.data());
    if (slow_.size() > 0)
      addPrior(Eigen::VectorXd::Zero(slow_.size()), Eigen::VectorXd::Ones(slow_.size()),
               slow_.data());
    residuals_.add({std::make_unique<GaugeCost>(problem_.states[0].T_WB), {bodies_[0].data()}});
  }

  /** Gaussian, its components independent. */
  void addPrior(const Eigen::VectorXd& mean, const Eigen::VectorXd& sigma, double* block) {
    const Eigen::MatrixXd whitening = sigma.cwiseInverse().asDiagonal();
    residuals_.add({std::make_unique<ceres::NormalPrior>(whitening, mean), {block}});
  }

  static std::vector<SE3> poses(const std::vector<NavState>& states) {
    std::vector<SE3> T_WB;
    for (const NavState& s : states) T_WB.push_back(s.T_WB);
    return T_WB;
  }

  /** Normal equations of the state, with landmarks and shared errors eliminated. */
  NormalEquations normalEquations(const std::vector<LinearizedResidual>& residuals) const {
    const Eigen::Index n = visual_.poseCount();
    NormalEquations equations(state_.columns()), seen(6 * n);
    addReducedVisualInformation(
        problem_.bundle.window, visual_.poses(), {visual_.landmarks(), visual_.held()},
        huberOfInliers(std::sqrt(options_.chi2_pixel), pixel_share_), 6, &seen);
    eliminateErrors(SharedErrorCost::inverseSigma(sigma_shared_rad_).cwiseAbs2().replicate(n, 1),
                    &seen);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        equations.score.block<6, 6>(9 * i, 9 * j) = seen.score.block<6, 6>(6 * i, 6 * j);
        equations.curvature.block<6, 6>(9 * i, 9 * j) = seen.curvature.block<6, 6>(6 * i, 6 * j);
      }
    addTurn(seen.score, &equations.score);
    addTurn(seen.curvature, &equations.curvature);
    addInformation(residuals, &equations);
    return equations;
  }

  /** A turn of the cameras moves the rotation of every pose that they see. */
  void addTurn(const Eigen::MatrixXd& seen, Eigen::MatrixXd* information) const {
    const Eigen::Index turn = state_.of(turn_.data()).column;
    for (Eigen::Index i = 0; i < visual_.poseCount(); ++i)
      for (Eigen::Index j = 0; j < visual_.poseCount(); ++j) {
        information->block<6, 3>(9 * i, turn) += seen.block<6, 3>(6 * i, 6 * j);
        information->block<3, 6>(turn, 9 * j) += seen.block<3, 6>(6 * i, 6 * j);
        information->block<3, 3>(turn, turn) += seen.block<3, 3>(6 * i, 6 * j);
      }
  }

  ImuBias bias() const { return {bias_.head<3>(), bias_.tail<3>()}; }

  void reintegrate() {
    for (Preintegration& p : problem_.preintegrations)
      if ((p.bias().gyro - bias().gyro).norm() > options_.reintegrate_gyro_rps ||
          (p.bias().accel - bias().accel).norm() > options_.reintegrate_accel_mps2)
        p = p.reintegrated(bias());
  }

  VisualInertialProblem& problem_;
  const VisualInertialBaOptions& options_;
  VisualProblem visual_;
  double sigma_shared_rad_, sigma_turn_rad_;
  std::vector<PoseBlock> bodies_;
  std::vector<Eigen::Vector3d> velocities_;
  Eigen::Matrix<double, 6, 1> bias_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();
  Eigen::MatrixXd slow_modes_;  ///< m/s^2, a row an interval, a column a mode
  Eigen::VectorXd slow_;        ///< of every mode [x, y, z], in standard deviations
  double pixel_share_ = 1.0;    ///< standard deviation of the pixels over that of the window
  AccelErrorSizes sizes_;
  StateBlocks state_;
  ResidualList residuals_;
};

}  // namespace

VisualInertialBaResult solveVisualInertialBa(VisualInertialProblem problem,
                                             const VisualInertialBaOptions& options) {
  VisualInertialBaResult result;
  result.states = problem.states;
  result.bias = problem.bias;
  const auto finish = [&]() -> VisualInertialBaResult& {
    result.bundle = std::move(problem.bundle);
    return result;
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
    if (!last) solver.followSizes();
  }
  solver.statistics(&result);
  return finish();
}

}  // namespace etalon
