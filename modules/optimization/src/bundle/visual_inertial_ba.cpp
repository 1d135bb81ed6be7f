#include "etalon/optimization/bundle/visual_inertial_ba.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "bundle/residual_redundancy.h"
#include "bundle/schur.h"
#include "bundle/visual_problem.h"
#include "etalon/core/so3.h"

namespace etalon {

void VisualInertialBaOptions::declare(ParameterSet& parameters) {
  parameters.add("rounds", &rounds, {1, 10},
                 "Rounds of optimisation; between two, outliers are relabelled and the IMU is "
                 "re-integrated where the bias moved far.");
  parameters.add("iterations_per_round", &iterations_per_round, {1, 200},
                 "Levenberg-Marquardt iterations of a round, at most.");
  parameters.add("converged_sigmas", &converged_sigmas, {1e-6, 10.0},
                 "Stop where a step of all states together is shorter than this many of its own "
                 "standard deviations; what did not get there has not converged.");
  parameters.add(
      "chi2_inertial", &huber_inertial, {0.1, 1e9},
      "Squared Huber width of an inertial residual (9 degrees of freedom, 95 %: 16.92).");
  parameters.add(
      "chi2_pixel", &huber_pixel, {0.1, 1e9},
      "Squared Huber width of a pixel, and the threshold above which it is an outlier (2 "
      "degrees of freedom, 95 %: 5.991).");
  parameters.add("sigma_shared_deg", &sigma_shared_deg, {1e-4, 10.0},
                 "Standard deviation of the error that all pixels of a keyframe share, as a "
                 "rotation an axis, deg (calibration; 0.01 deg is 0.08 px at 460 px of focal "
                 "length). 1e-4: practically none.");
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
  const Eigen::Index v = 9 * (static_cast<Eigen::Index>(states.size()) - 1) + 6;
  return std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(v).maxCoeff()));
}

namespace {

/**
 * Ends a run by the length of the step in its own standard deviations: the square of that is twice
 * the decrease that the step promises (g^T H^-1 g, Newton's decrement). The relative decrease of
 * the cost is blind to what few residuals determine, such as gravity at rest.
 */
class StepWatch : public ceres::IterationCallback {
 public:
  /** Inverse of the damping relative to the diagonal: where it is larger even the direction known
   * worst, gravity against b_a, is not held back. */
  static constexpr double kUndamped = 1e7;

  explicit StepWatch(double converged_sigmas) : converged_sigmas_(converged_sigmas) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration == 0 || !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    // relative_decrease is what the step brought over what it promised.
    last_step_sigmas_ = std::sqrt(2.0 * std::max(0.0, summary.cost_change) /
                                  std::max(1e-12, summary.relative_decrease));
    const bool enough =
        last_step_sigmas_ < converged_sigmas_ && summary.trust_region_radius >= kUndamped;
    return enough ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  double lastStepSigmas() const { return last_step_sigmas_; }

 private:
  double converged_sigmas_;
  double last_step_sigmas_ = std::numeric_limits<double>::infinity();
};

/** State, costs and solution of one visual-inertial BA. */
class VisualInertialSolver {
 public:
  VisualInertialSolver(const VisualWindow& window, std::vector<Preintegration> preintegrations,
                       const std::vector<VisualInertialState>& states, const ImuBias& bias,
                       const std::vector<Eigen::Vector3d>& landmarks,
                       const VisualInertialBaOptions& options)
      : window_(window),
        options_(options),
        preintegrations_(std::move(preintegrations)),
        g_W_(0.0, 0.0, -options.gravity_mps2),
        visual_(window, poses(states), landmarks),
        shared_(M_PI / 180.0 * options.sigma_shared_deg),
        gauge_(states.front().T_WB),
        prior_(options.prior_mean, options.prior_sigma_gyro_rps, options.prior_sigma_accel_mps2),
        inertial_loss_(std::sqrt(options.huber_inertial)) {
    for (const VisualInertialState& s : states) {
      bodies_.push_back(toBlock(s.T_WB));
      velocities_.push_back(s.v_WB);
    }
    bias_ << bias.gyro, bias.accel;
  }

  /** One Ceres run, ended by a step shorter than `converged_sigmas`; false if it failed
   * numerically. */
  bool solve(const std::vector<char>& inlier, double converged_sigmas,
             VisualInertialBaResult* result) {
    reintegrate();
    inertial_costs_.clear();
    for (const Preintegration& p : preintegrations_) inertial_costs_.emplace_back(p, g_W_);
    const auto problem = visual_.makeProblem(inlier, options_.huber_pixel);
    std::vector<double*> others;
    for (size_t k = 0; k < bodies_.size(); ++k) {
      problem->AddParameterBlock(bodies_[k].data(), 7, &manifold_);
      problem->AddResidualBlock(&shared_, nullptr, bodies_[k].data(),
                                visual_.pose(static_cast<int>(k)));
      others.push_back(bodies_[k].data());
    }
    for (size_t k = 0; k < inertial_costs_.size(); ++k)
      problem->AddResidualBlock(&inertial_costs_[k], &inertial_loss_, bodies_[k].data(),
                                velocities_[k].data(), bodies_[k + 1].data(),
                                velocities_[k + 1].data(), bias_.data());
    problem->AddResidualBlock(&prior_, nullptr, bias_.data());
    problem->AddResidualBlock(&gauge_, nullptr, bodies_[0].data());
    for (Eigen::Vector3d& velocity : velocities_) others.push_back(velocity.data());
    others.push_back(bias_.data());
    StepWatch watch(converged_sigmas);
    ceres::Solver::Options solver =
        visual_.solverOptions(*problem, others, options_.iterations_per_round);
    solver.callbacks.push_back(&watch);
    solver.function_tolerance = 0.0;
    solver.initial_trust_region_radius = 10.0 * StepWatch::kUndamped;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, problem.get(), &summary);
    result->iterations += static_cast<int>(summary.iterations.size());
    // CONVERGENCE is left to what is exact to rounding: a gradient or a step of zero.
    result->converged = summary.termination_type == ceres::USER_SUCCESS ||
                        summary.termination_type == ceres::CONVERGENCE;
    result->last_step_sigmas = watch.lastStepSigmas();
    result->message = summary.message;
    return summary.IsSolutionUsable();
  }

  void store(VisualInertialBaResult* result) const {
    for (size_t k = 0; k < bodies_.size(); ++k) {
      result->states[k].T_WB = fromBlock(bodies_[k].data());
      result->states[k].v_WB = velocities_[k];
    }
    result->bias = bias();
    result->landmarks = visual_.positions();
  }

  /** Of the body as the cameras see it, errors that all pixels of a keyframe share included. */
  std::vector<SE3> posesSeen() const { return visual_.poses(); }

  /** Counts and sums of the residuals; with `with_covariance` also what the normal equations say.
   */
  void statistics(bool with_covariance, VisualInertialBaResult* result) {
    visual_.holdAtInfinity(result->inlier);
    const std::vector<InertialResidual> inertial = inertialResiduals(*result);
    result->gyro_bias_sigmas =
        (result->bias.gyro - options_.prior_mean.gyro).norm() / options_.prior_sigma_gyro_rps;
    result->accel_bias_sigmas =
        (result->bias.accel - options_.prior_mean.accel).norm() / options_.prior_sigma_accel_mps2;
    int landmark_unknowns = 0;
    for (size_t l = 0; l < result->landmark_valid.size(); ++l)
      if (result->landmark_valid[l]) landmark_unknowns += visual_.held()[l] ? 2 : 3;
    result->inlier_measurements =
        static_cast<int>(std::count(result->inlier.begin(), result->inlier.end(), 1));
    result->measurements = static_cast<int>(result->inlier.size());
    result->dof_visual = 2 * result->inlier_measurements - landmark_unknowns;
    if (!with_covariance) return;
    const NormalEquations equations = normalEquations(*result, inertial);
    result->covariance = covarianceOrEmpty(equations.curvature, equations.score);
    const Eigen::MatrixXd inverse = inverseOrEmpty(equations.score);  // of the fit
    if (result->covariance.size() == 0 || inverse.size() == 0) return;
    result->noise = checkNoise(
        {window_, posesSeen(), result->landmarks, result->inlier, landmark_unknowns,
         options_.huber_pixel, options_.prior_sigma_gyro_rps, options_.prior_sigma_accel_mps2},
        inertial, inverse);
  }

 private:
  static std::vector<SE3> poses(const std::vector<VisualInertialState>& states) {
    std::vector<SE3> T_WB;
    for (const VisualInertialState& s : states) T_WB.push_back(s.T_WB);
    return T_WB;
  }

  /** Of [pose, velocity] of every keyframe and the biases, at the solution. */
  NormalEquations normalEquations(const VisualInertialBaResult& result,
                                  const std::vector<InertialResidual>& inertial) const {
    const Eigen::Index n = static_cast<Eigen::Index>(result.states.size());
    const Eigen::Index bias = 9 * n;
    NormalEquations equations(bias + 6);
    NormalEquations seen(6 * n);
    addReducedVisualInformation(window_, posesSeen(), {visual_.landmarks(), visual_.held()},
                                result.inlier, options_.huber_pixel, 6, &seen);
    eliminateErrors(shared_.inverseSigma().cwiseAbs2().replicate(n, 1), &seen);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        equations.score.block<6, 6>(9 * i, 9 * j) = seen.score.block<6, 6>(6 * i, 6 * j);
        equations.curvature.block<6, 6>(9 * i, 9 * j) = seen.curvature.block<6, 6>(6 * i, 6 * j);
      }
    for (size_t k = 0; k < inertial.size(); ++k) {
      const Eigen::Matrix<double, 9, 24>& A = inertial[k].J;
      const Eigen::Matrix<double, 24, 24> AtA = inertial[k].weight * A.transpose() * A;
      const Eigen::Index i = 9 * static_cast<Eigen::Index>(k);
      equations.add(i, i, AtA.topLeftCorner<18, 18>());
      equations.add(i, bias, AtA.topRightCorner<18, 6>());
      equations.add(bias, i, AtA.bottomLeftCorner<6, 18>());
      equations.add(bias, bias, AtA.bottomRightCorner<6, 6>());
    }
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
    equations.add(bias, bias, std::pow(options_.prior_sigma_gyro_rps, -2) * I);
    equations.add(bias + 3, bias + 3, std::pow(options_.prior_sigma_accel_mps2, -2) * I);
    const Eigen::RowVector3d yaw = GaugeCost::kInverseSigma * result.states[0].T_WB.R.row(2);
    equations.add(0, 0, yaw.transpose() * yaw);
    equations.add(3, 3, GaugeCost::kInverseSigma * GaugeCost::kInverseSigma * I);
    return equations;
  }

  ImuBias bias() const { return {bias_.head<3>(), bias_.tail<3>()}; }

  void reintegrate() {
    for (Preintegration& p : preintegrations_)
      if ((p.bias().gyro - bias().gyro).norm() > options_.reintegrate_gyro_rps ||
          (p.bias().accel - bias().accel).norm() > options_.reintegrate_accel_mps2)
        p = p.reintegrated(bias());
  }

  /** At the solution, whitened rotation first. */
  std::vector<InertialResidual> inertialResiduals(const VisualInertialBaResult& result) const {
    std::vector<InertialResidual> residuals(preintegrations_.size());
    for (size_t k = 0; k < residuals.size(); ++k) {
      InertialResidual& out = residuals[k];
      const VisualInertialState &i = result.states[k], &j = result.states[k + 1];
      PreintegrationJacobians J;
      out.r = preintegrationResidual(preintegrations_[k], i.T_WB, i.v_WB, j.T_WB, j.v_WB,
                                     result.bias, g_W_, &J);
      out.J << J.pose_i, J.velocity_i, J.pose_j, J.velocity_j, J.bias_gyro, J.bias_accel;
      const Eigen::LLT<Eigen::Matrix<double, 9, 9>> C(preintegrations_[k].covariance9());
      C.matrixL().solveInPlace(out.r);
      C.matrixL().solveInPlace(out.J);
      const double norm = out.r.norm(), huber = std::sqrt(options_.huber_inertial);
      out.weight = norm > huber ? huber / norm : 1.0;
    }
    return residuals;
  }

  const VisualWindow& window_;
  const VisualInertialBaOptions& options_;
  std::vector<Preintegration> preintegrations_;
  Eigen::Vector3d g_W_;
  VisualProblem visual_;
  std::vector<PoseBlock> bodies_;
  std::vector<Eigen::Vector3d> velocities_;
  Eigen::Matrix<double, 6, 1> bias_;
  PoseManifold manifold_;
  SharedErrorCost shared_;
  GaugeCost gauge_;
  BiasPriorCost prior_;
  ceres::HuberLoss inertial_loss_;
  std::deque<PreintegrationCost> inertial_costs_;
};

}  // namespace

VisualInertialBaResult solveVisualInertialBa(const VisualWindow& window,
                                             const std::vector<Preintegration>& preintegrations,
                                             const std::vector<VisualInertialState>& states,
                                             const ImuBias& bias,
                                             const std::vector<Eigen::Vector3d>& landmarks,
                                             const std::vector<char>& landmark_valid,
                                             const VisualInertialBaOptions& options) {
  VisualInertialBaResult result;
  result.states = states;
  result.bias = bias;
  result.landmarks = landmarks;
  result.landmark_valid = landmark_valid;
  std::vector<SE3> T_WB;
  for (const VisualInertialState& s : states) T_WB.push_back(s.T_WB);
  // First round: all but gross outliers (30 sigma), the kernel does the rest.
  relabelMeasurements(window, T_WB, landmarks, kGrossOutlier * kGrossOutlier,
                      &result.landmark_valid, &result.inlier);
  if (std::count(result.inlier.begin(), result.inlier.end(), 1) == 0) {
    result.message = "no landmark agrees with the initial poses";
    return result;
  }
  VisualInertialSolver solver(window, preintegrations, states, bias, landmarks, options);
  // Before outliers are relabelled the minimum is not the last one.
  const double first_rounds = std::max(1.0, options.converged_sigmas);
  for (int round = 0; round < options.rounds; ++round) {
    const bool last = round + 1 == options.rounds;
    const double enough = last ? options.converged_sigmas : first_rounds;
    if (!solver.solve(result.inlier, enough, &result)) return result;
    solver.store(&result);
    T_WB = solver.posesSeen();
    result.landmark_valid = landmark_valid;
    result.chi2_visual = relabelMeasurements(window, T_WB, result.landmarks, options.huber_pixel,
                                             &result.landmark_valid, &result.inlier);
    if (std::count(result.inlier.begin(), result.inlier.end(), 1) == 0) {
      result.converged = false;
      result.message = "every measurement became an outlier";
      return result;
    }
  }
  result.message.clear();
  solver.statistics(options.compute_covariance, &result);
  return result;
}

}  // namespace etalon
