#include "window_solver.h"

#include <algorithm>
#include <cmath>

#include "rest.h"

namespace etalon::fixed_lag {
namespace {

/** What a step may have to be taken back to. */
struct Saved {
  std::vector<NavState> states;
  std::vector<Eigen::Vector3d> landmarks;

  Saved(const Window& window, const std::vector<Landmark*>& of) {
    for (const WindowState& state : window.states) states.push_back(state.now);
    for (const Landmark* landmark : of) landmarks.push_back(landmark->in_host.parameters);
  }
  void restore(Window* window, const std::vector<Landmark*>& to) const {
    for (size_t i = 0; i < states.size(); ++i) {
      WindowState& state = window->states[i];
      state.now = states[i];
      if (!state.fixed) state.linearization = state.now;
    }
    for (size_t i = 0; i < landmarks.size(); ++i) to[i]->in_host.parameters = landmarks[i];
  }
};

void moveStates(const Eigen::VectorXd& step, Window* window) {
  for (WindowState& state : window->states) {
    Vector15d delta = state.delta();
    delta.head(state.size()) += step.segment(state.column, state.size());
    state.now = state.linearization.plus(delta);
    if (!state.fixed) state.linearization = state.now;
  }
}

}  // namespace

Vector15d inertialRows(const Window& window, size_t i, Matrix15d* J_i, Matrix15d* J_j) {
  const WindowState &a = window.states[i - 1], &b = window.states[i];
  const Matrix15d& L = b.imu_sqrt_information;
  const bool moved = a.fixed || b.fixed;
  Vector15d r = inertialResidual(b.imu, a.now, b.now, window.g_W, moved ? nullptr : J_i,
                                 moved ? nullptr : J_j);
  if (J_i && moved) inertialResidual(b.imu, a.linearization, b.linearization, window.g_W, J_i, J_j);
  if (J_i) {
    *J_i = L.triangularView<Eigen::Upper>() * (*J_i);
    *J_j = L.triangularView<Eigen::Upper>() * (*J_j);
  }
  return L.triangularView<Eigen::Upper>() * r;
}

Eigen::VectorXd deltas(const Window& window, Eigen::Index unknowns) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(window.unknowns());
  for (const WindowState& state : window.states)
    if (state.fixed) all.segment(state.column, state.size()) = state.delta().head(state.size());
  return all.head(unknowns);
}

/** Adds whitened rows between the full states `i - 1` and `i`. */
template <typename Residual, typename Jacobian>
static void addRows(const Window& window, size_t i, const Residual& r, const Jacobian& J_i,
                    const Jacobian& J_j, NormalEquations* equations) {
  const Eigen::Index a = window.states[i - 1].column, b = window.states[i].column;
  equations->H.block<15, 15>(a, a).noalias() += J_i.transpose() * J_i;
  equations->H.block<15, 15>(b, b).noalias() += J_j.transpose() * J_j;
  const Matrix15d mixed = J_i.transpose() * J_j;
  equations->H.block<15, 15>(a, b) += mixed;
  equations->H.block<15, 15>(b, a) += mixed.transpose();
  equations->g.segment<15>(a).noalias() += J_i.transpose() * r;
  equations->g.segment<15>(b).noalias() += J_j.transpose() * r;
  equations->cost += r.squaredNorm();
}

void addInertialTerms(const Window& window, NormalEquations* equations) {
  for (size_t i = window.firstFull() + 1; i < window.states.size(); ++i) {
    Matrix15d J_i, J_j;
    const Vector15d r = inertialRows(window, i, &J_i, &J_j);
    addRows(window, i, r, J_i, J_j, equations);
    if (!window.states[i].at_rest) continue;
    RestJacobian rest_i, rest_j;
    const Eigen::Matrix<double, 9, 1> rest = restRows(window, i, &rest_i, &rest_j);
    addRows(window, i, rest, rest_i, rest_j, equations);
  }
}

void addPrior(const Window& window, NormalEquations* equations) {
  const LinearRows& prior = window.prior;
  const Eigen::Index n = prior.unknowns();
  if (n == 0) return;
  const Eigen::VectorXd r = prior.A * deltas(window, n) + prior.b;
  equations->H.topLeftCorner(n, n).selfadjointView<Eigen::Lower>().rankUpdate(prior.A.transpose());
  equations->H.topLeftCorner(n, n).triangularView<Eigen::StrictlyUpper>() =
      equations->H.topLeftCorner(n, n).transpose();
  equations->g.head(n).noalias() += prior.A.transpose() * r;
  equations->cost += r.squaredNorm();
}

void WindowSolver::linearize(Window* window, NormalEquations* equations) {
  *equations = NormalEquations(window->unknowns());
  addPrior(*window, equations);
  addInertialTerms(*window, equations);
  visual_.linearize(*window, landmarks_, static_cast<int>(window->states.size()), equations);
}

double WindowSolver::costOf(const Window& window) const {
  double cost = visual_.cost(window, landmarks_);
  if (window.prior.unknowns() > 0)
    cost +=
        (window.prior.A * deltas(window, window.prior.unknowns()) + window.prior.b).squaredNorm();
  for (size_t i = window.firstFull() + 1; i < window.states.size(); ++i)
    cost += inertialRows(window, i).squaredNorm() +
            (window.states[i].at_rest ? restRows(window, i).squaredNorm() : 0.0);
  return cost;
}

SolverResult WindowSolver::solve(Window* window) {
  SolverResult result;
  landmarks_.clear();
  for (auto& [id, landmark] : window->landmarks)
    if (landmark.observations.size() > 1) landmarks_.push_back(&landmark);
  NormalEquations equations(0);
  linearize(window, &equations);
  result.cost = equations.cost;
  double damping = 0.0;
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd scale;
  const Eigen::Index n = window->unknowns();
  for (int attempt = 0; attempt < options_.iterations + 3; ++attempt) {
    // Scaled to a unit diagonal: the unknowns' units differ by many orders of magnitude.
    scale = equations.H.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd scaled = scale.asDiagonal() * equations.H * scale.asDiagonal();
    scaled.diagonal().array() += damping;
    factor.compute(scaled);
    if (factor.info() != Eigen::Success) {
      damping = std::max(1e-8, 10.0 * damping);
      continue;
    }
    const Eigen::VectorXd step =
        -scale.cwiseProduct(factor.solve(Eigen::VectorXd(scale.cwiseProduct(equations.g))));
    const double promised = -step.dot(equations.g);  // squared length of the step in its sigmas
    const Saved saved(*window, landmarks_);
    moveStates(step, window);
    visual_.solveLandmarks(*window, step);
    const bool last = result.iterations + 1 >= options_.iterations ||
                      promised < options_.converged_sigmas * options_.converged_sigmas;
    NormalEquations next(0);
    const double cost = last ? costOf(*window) : (linearize(window, &next), next.cost);
    if (!(cost <= result.cost * (1.0 + 1e-9) + 1e-9)) {
      saved.restore(window, landmarks_);
      damping = std::max(1e-6, 10.0 * damping);
      if (!last) linearize(window, &equations);
      continue;
    }
    ++result.iterations;
    result.cost = cost;
    damping = damping > 1e-6 ? 0.1 * damping : 0.0;
    result.converged = promised < options_.converged_sigmas * options_.converged_sigmas;
    if (last) break;
    equations = std::move(next);
  }
  if (factor.info() == Eigen::Success) {
    const Eigen::MatrixXd newest = Eigen::MatrixXd::Identity(n, n).rightCols(15);
    const Eigen::VectorXd tail = scale.tail(15);
    const Matrix15d block = factor.solve(newest).bottomRows(15);
    result.covariance = tail.asDiagonal() * block * tail.asDiagonal();
    result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  }
  return result;
}

}  // namespace etalon::fixed_lag
