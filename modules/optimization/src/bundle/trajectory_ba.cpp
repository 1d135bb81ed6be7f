#include "etalon/optimization/bundle/trajectory_ba.h"

#include <ceres/iteration_callback.h>
#include <ceres/loss_function.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "bundle/visual_problem.h"
#include "etalon/optimization/residuals/cauchy.h"
#include "residuals/gauge_cost.h"
#include "residuals/inertial_cost.h"

namespace etalon {
namespace {

/** Counts the iterations of all rounds, and asks after each whether to go on. */
class IterationWatch : public ceres::IterationCallback {
 public:
  explicit IterationWatch(std::function<bool(int iterations)> go_on) : go_on_(std::move(go_on)) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& iteration) override {
    if (iteration.iteration > 0) ++iterations_;  // 0 is the evaluation at the start
    stopped_ = stopped_ || (go_on_ && !go_on_(iterations_));
    return stopped_ ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }
  bool stopped() const { return stopped_; }

 private:
  std::function<bool(int iterations)> go_on_;
  int iterations_ = 0;
  bool stopped_ = false;
};

/** Costs, blocks and solution of one batch. */
class TrajectorySolver {
 public:
  explicit TrajectorySolver(TrajectoryBaProblem* problem)
      : problem_(*problem), visual_(problem->bundle, poses(problem->states)) {
    for (const NavState& state : problem->states) motions_.push_back(toMotionBlock(state));
  }

  void solve(double noise_factor, int iterations, IterationWatch* watch, SolverSummary* summary) {
    reintegrate();
    const double variance = noise_factor * noise_factor;
    const auto problem = visual_.makeProblem(std::make_unique<ceres::ScaledLoss>(
        new ceres::CauchyLoss(std::sqrt(kCauchyChi2 * variance)), kCauchyGain / variance,
        ceres::TAKE_OWNERSHIP));
    inertial_.clear();
    const Eigen::Vector3d g_W(0.0, 0.0, -problem_.gravity_mps2);
    for (size_t k = 0; k < problem_.preintegrations.size(); ++k) {
      inertial_.emplace_back(problem_.preintegrations[k], g_W);
      problem->AddResidualBlock(&inertial_.back(), nullptr, visual_.pose(k), motions_[k].data(),
                                visual_.pose(k + 1), motions_[k + 1].data());
    }
    GaugeCost gauge(problem_.states[0].T_WB);
    ceres::NormalPrior first_bias = firstBiasPrior();
    problem->AddResidualBlock(&gauge, nullptr, visual_.pose(0));
    problem->AddResidualBlock(&first_bias, nullptr, motions_[0].data());
    ceres::Solver::Options solver = visual_.solverOptions(*problem, iterations);
    solver.linear_solver_type = ceres::SPARSE_SCHUR;
    solver.initial_trust_region_radius = 1e8;
    // In the order of time the reduced matrix is a band as wide as tracks are long. Keyframes that
    // others found again are its border.
    const std::vector<char> border = spanningKeyframes();
    for (size_t k = 0; k < motions_.size(); ++k) {
      const int group = 2 * static_cast<int>(k + border[k] * motions_.size()) + 1;
      solver.linear_solver_ordering->AddElementToGroup(visual_.pose(k), group);
      solver.linear_solver_ordering->AddElementToGroup(motions_[k].data(), group + 1);
    }
    solver.callbacks.push_back(watch);
    ceres::Solver::Summary run;
    ceres::Solve(solver, problem.get(), &run);
    addRun(run, summary);
    visual_.landmarks().store(&problem_.bundle);
  }

  std::vector<NavState> states() {
    std::vector<NavState> result;
    for (size_t k = 0; k < motions_.size(); ++k)
      result.push_back(toNavState(visual_.pose(k), motions_[k].data()));
    return result;
  }
  std::vector<SE3> poses() const { return visual_.poses(); }

 private:
  static std::vector<SE3> poses(const std::vector<NavState>& states) {
    std::vector<SE3> T_WB;
    for (const NavState& state : states) T_WB.push_back(state.T_WB);
    return T_WB;
  }

  /** Keyframes of a landmark's first sighting where the next one is long after it. */
  std::vector<char> spanningKeyframes() const {
    constexpr int kLong = 30;  // keyframes; tracks live for up to ten
    std::vector<char> spans(motions_.size(), 0);
    const VisualWindow& window = problem_.bundle.window;
    for (int l = 0; l < window.landmarkCount(); ++l) {
      int before = -1;
      for (const VisualMeasurement& m : window.measurementsOf(static_cast<size_t>(l))) {
        if (before >= 0 && m.keyframe - before > kLong) spans[before] = 1;
        before = m.keyframe;
      }
    }
    return spans;
  }

  /** What is believed of the first state's biases. */
  ceres::NormalPrior firstBiasPrior() const {
    const BiasPriors& priors = problem_.priors;
    ceres::Matrix whitening = ceres::Matrix::Zero(6, 9);
    whitening.rightCols<6>().diagonal() << Eigen::Vector3d::Constant(1.0 / priors.sigma_gyro_rps),
        Eigen::Vector3d::Constant(1.0 / priors.sigma_accel_mps2);
    ceres::Vector mean(9);
    mean << Eigen::Vector3d::Zero(), priors.mean.gyro, priors.mean.accel;
    return {whitening, mean};
  }

  /** Integrates the raw samples anew, at the biases that are known by now. */
  void reintegrate() {
    for (size_t k = 0; k < problem_.preintegrations.size(); ++k) {
      const double* motion = motions_[k].data();
      problem_.preintegrations[k] =
          problem_.preintegrations[k].reintegrated({Eigen::Map<const Eigen::Vector3d>(motion + 3),
                                                    Eigen::Map<const Eigen::Vector3d>(motion + 6)});
    }
  }

  TrajectoryBaProblem& problem_;
  VisualProblem visual_;
  std::vector<MotionBlock> motions_;
  std::deque<InertialCost> inertial_;
};

}  // namespace

TrajectoryBaResult solveTrajectoryBa(TrajectoryBaProblem problem,
                                     const TrajectoryBaOptions& options) {
  TrajectoryBaResult result;
  result.states = problem.states;
  std::vector<SE3> T_WB;
  for (const NavState& state : problem.states) T_WB.push_back(state.T_WB);
  BundleProblem& bundle = problem.bundle;
  bundle.triangulateMissing(T_WB);
  bundle.relabel(T_WB, kGrossOutlier * kGrossOutlier);
  if (problem.states.size() < 2 || bundle.inlierCount() == 0) {
    result.summary.stop(Termination::kNotStarted, "no landmark agrees with the initial poses");
    result.bundle = std::move(bundle);
    return result;
  }
  TrajectorySolver solver(&problem);
  IterationWatch watch(options.go_on);
  for (int round = 0; round < options.rounds; ++round) {
    const bool last = round + 1 == options.rounds;
    solver.solve(result.noise_factor, last ? options.last_iterations : options.iterations_per_round,
                 &watch, &result.summary);
    if (watch.stopped()) {
      result.summary.stop(Termination::kStopped, "it was told to stop");
      break;
    }
    T_WB = solver.poses();
    bundle.relabel(T_WB, options.chi2_outlier);
    if (bundle.inlierCount() == 0) {
      result.summary.stop(Termination::kFailed, "every measurement became an outlier");
      break;
    }
    result.noise_factor = std::max(options.least_noise_factor, bundle.medianNoise(T_WB));
  }
  if (result.summary.usable()) result.states = solver.states();
  result.bundle = std::move(bundle);
  return result;
}

}  // namespace etalon
