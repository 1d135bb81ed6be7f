#include "window_solver.h"

#include <algorithm>
#include <cmath>

#include "rest.h"

namespace etalon::fixed_lag {
namespace {

/** The values that a rejected step goes back to. */
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

/** A^T A, of an A that is triangular after a slide, the last columns in the first rows: the zeros
 * are left out. */
Eigen::MatrixXd squareOf(const Eigen::MatrixXd& A) {
  constexpr Eigen::Index kColumns = 32;  // at a time
  const Eigen::Index n = A.cols();
  Eigen::MatrixXd H(n, n);
  for (Eigen::Index c = 0; c < n; c += kColumns) {
    const Eigen::Index width = std::min(kColumns, n - c), end = c + width;
    Eigen::Index rows = A.rows();
    while (rows > 0 && A.block(rows - 1, c, 1, width).isZero(0.0)) --rows;
    H.block(0, c, end, width).noalias() =
        A.topLeftCorner(rows, end).transpose() * A.block(0, c, rows, width);
  }
  H.triangularView<Eigen::StrictlyLower>() = H.transpose();
  return H;
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
  if (window.calibration.unknown) all.head<kCalibrationSize>() = window.calibration.now;
  for (const WindowState& state : window.states)
    if (state.fixed) all.segment(state.column, state.size()) = state.delta().head(state.size());
  return all.head(unknowns);
}

/** Adds whitened rows between the full states `i - 1` and `i`. */
template <typename Residual, typename Jacobian>
static void addRows(const Window& window, size_t i, const Residual& r, const Jacobian& J_i,
                    const Jacobian& J_j, NormalEquations* equations) {
  const Eigen::Index a = window.states[i - 1].column, b = window.states[i].column;
  equations->g.segment<15>(a).noalias() += J_i.transpose() * r;
  equations->g.segment<15>(b).noalias() += J_j.transpose() * r;
  equations->cost += r.squaredNorm();
  if (equations->H.size() == 0) return;
  equations->H.block<15, 15>(a, a).noalias() += J_i.transpose() * J_i;
  equations->H.block<15, 15>(b, b).noalias() += J_j.transpose() * J_j;
  const Matrix15d mixed = J_i.transpose() * J_j;
  equations->H.block<15, 15>(a, b) += mixed;
  equations->H.block<15, 15>(b, a) += mixed.transpose();
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

void addPrior(const Window& window, const Eigen::MatrixXd& H, NormalEquations* equations) {
  const LinearRows& prior = window.prior;
  const Eigen::Index n = prior.unknowns();
  if (n == 0) return;
  const Eigen::VectorXd r = prior.A * deltas(window, n) + prior.b;
  if (equations->H.size() > 0) equations->H.topLeftCorner(n, n) += H;
  equations->g.head(n).noalias() += prior.A.transpose() * r;
  equations->cost += r.squaredNorm();
}

void WindowSolver::linearize(Window* window, NormalEquations* equations, bool calibration) {
  *equations = NormalEquations(window->unknowns());
  addPrior(*window, prior_H_, equations);
  addInertialTerms(*window, equations);
  visual_.linearize(*window, landmarks_, static_cast<int>(window->states.size()), equations,
                    calibration);
}

NormalEquations WindowSolver::gradient(const Window& window) {
  NormalEquations equations = NormalEquations::gradientOf(window.unknowns());
  addPrior(window, prior_H_, &equations);
  addInertialTerms(window, &equations);
  visual_.updateGradient(window, &equations);
  return equations;
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

/** Prepares what stays the same over the steps. */
void WindowSolver::begin(Window* window, bool same_prior) {
  landmarks_.clear();
  for (auto& [id, landmark] : window->landmarks)
    if (landmark.observations.size() > 1) landmarks_.push_back(&landmark);
  if (!same_prior) prior_H_ = squareOf(window->prior.A);
  eliminateUntouched(*window);
}

void WindowSolver::eliminateUntouched(const Window& window) {
  std::vector<char> touched(window.states.size(), 0);
  for (size_t i = 0; i < window.states.size(); ++i) touched[i] = !window.states[i].retained;
  for (const Landmark* landmark : landmarks_) {
    touched[landmark->host] = 1;
    for (const LandmarkObservation& o : landmark->observations) touched[o.state] = 1;
  }
  untouched_.clear();
  rest_.clear();
  for (size_t i = 0; i < window.states.size(); ++i)
    for (Eigen::Index c = 0; c < window.states[i].size(); ++c)
      (touched[i] ? rest_ : untouched_).push_back(window.states[i].column + c);
  if (untouched_.empty()) return;
  const Eigen::Index in_prior = prior_H_.cols();
  untouched_factor_.compute(prior_H_(untouched_, untouched_));
  untouched_rest_.setZero(untouched_.size(), rest_.size());
  for (size_t c = 0; c < rest_.size(); ++c)
    if (rest_[c] < in_prior) untouched_rest_.col(c) = prior_H_(untouched_, rest_[c]);
  follows_ = untouched_factor_.solve(untouched_rest_);
}

/** Factorizes the equations that remain when the untouched unknowns are eliminated. */
bool WindowSolver::factorize(const NormalEquations& equations, double damping) {
  if (!untouched_.empty() && untouched_factor_.info() != Eigen::Success) return false;
  Eigen::MatrixXd H;
  const bool all = static_cast<Eigen::Index>(rest_.size()) == equations.H.cols();
  if (!all) H = equations.H(rest_, rest_);
  if (!untouched_.empty()) H.noalias() -= untouched_rest_.transpose() * follows_;
  const Eigen::MatrixXd& reduced = all ? equations.H : H;
  // Scaled to a unit diagonal: the unknowns' units differ by many orders of magnitude.
  scale_ = reduced.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale_.asDiagonal() * reduced * scale_.asDiagonal();
  scaled.diagonal().array() += damping;
  factor_.compute(scaled);
  return factor_.info() == Eigen::Success;
}

Eigen::VectorXd WindowSolver::stepOf(const NormalEquations& equations) const {
  Eigen::VectorXd g = equations.g(rest_);
  const Eigen::VectorXd g_untouched = equations.g(untouched_);
  if (!untouched_.empty()) g.noalias() -= follows_.transpose() * g_untouched;
  const Eigen::VectorXd rest =
      -scale_.cwiseProduct(factor_.solve(Eigen::VectorXd(scale_.cwiseProduct(g))));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(equations.g.size());
  step(rest_) = rest;
  if (!untouched_.empty())
    step(untouched_) = -untouched_factor_.solve(g_untouched) - follows_ * rest;
  return step;
}

Eigen::MatrixXd WindowSolver::covariance(const std::vector<Eigen::Index>& unknowns) const {
  if (factor_.info() != Eigen::Success) return {};
  // x_untouched = -follows_ x_rest + e with e independent of x_rest, of the inverse of their block.
  const Eigen::Index n = unknowns.size();
  Eigen::MatrixXd by_rest = Eigen::MatrixXd::Zero(rest_.size(), n);
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(untouched_.size(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index unknown = unknowns[i];
    const auto in_rest = std::lower_bound(rest_.begin(), rest_.end(), unknown);
    if (in_rest != rest_.end() && *in_rest == unknown) {
      by_rest(in_rest - rest_.begin(), i) = 1.0;
    } else {
      const auto in_untouched = std::lower_bound(untouched_.begin(), untouched_.end(), unknown);
      own(in_untouched - untouched_.begin(), i) = 1.0;
      by_rest.col(i) = -follows_.row(in_untouched - untouched_.begin());
    }
  }
  by_rest = scale_.asDiagonal() * by_rest;
  factor_.matrixL().solveInPlace(by_rest);
  Eigen::MatrixXd covariance = by_rest.transpose() * by_rest;
  if (!untouched_.empty()) {
    untouched_factor_.matrixL().solveInPlace(own);
    covariance.noalias() += own.transpose() * own;
  }
  return covariance;
}

bool WindowSolver::moveCalibration(const CalibrationVector& to, Window* window) {
  begin(window, false);
  NormalEquations equations(0);
  linearize(window, &equations, true);
  if (!factorize(equations, 0.0)) return false;
  const CalibrationVector moved = to - window->calibration.now;
  equations.g.noalias() += equations.H.leftCols<kCalibrationSize>() * moved;
  Eigen::VectorXd step = stepOf(equations);
  step.head<kCalibrationSize>() = moved;
  moveStates(step, window);
  visual_.solveLandmarks(*window, step);
  setCalibration(to, window);
  return true;
}

SolverResult WindowSolver::solve(Window* window, int iterations, bool same_prior) {
  SolverResult result;
  begin(window, same_prior);
  NormalEquations equations(0);
  linearize(window, &equations);
  result.cost = equations.cost;
  const double converged_sigmas =
      options_.converged_sigmas * (window->states.back().keyframe ? 1.0 : 3.0);
  double damping = 0.0, damping_of_factor = 0.0;
  bool positive = false, factorized = false;
  for (int attempt = 0; attempt < iterations + 3; ++attempt) {
    const bool reused = factorized;
    if (!reused) {
      positive = factorize(equations, damping);
      damping_of_factor = damping;
    }
    if (!positive) {
      damping = std::max(1e-8, 10.0 * damping);
      continue;
    }
    const Eigen::VectorXd step = stepOf(equations);
    const double promised = -step.dot(equations.g);  // squared length of the step in its sigmas
    const Saved saved(*window, landmarks_);
    moveStates(step, window);
    visual_.solveLandmarks(*window, step);
    result.converged = damping == 0.0 && promised < converged_sigmas * converged_sigmas;
    if (result.converged) {  // no worse than promised, to first order of what is left
      ++result.iterations;
      result.cost -= promised;
      break;
    }
    const bool last = result.iterations + 1 >= iterations;
    // A plain step is followed by one by the same matrix: what has changed in it is of second order.
    factorized = !last && !reused && damping == 0.0;
    NormalEquations next(0);
    if (factorized)
      next = gradient(*window);
    else if (!last)
      linearize(window, &next);
    const double cost = last ? costOf(*window) : next.cost;
    if (!(cost <= result.cost * (1.0 + 1e-9) + 1e-9)) {
      saved.restore(window, landmarks_);
      factorized = false;
      if (!reused) damping = std::max(1e-6, 10.0 * damping);
      if (!last || reused) linearize(window, &equations);
      continue;
    }
    ++result.iterations;
    result.cost = cost;
    damping = damping > 1e-6 ? 0.1 * damping : 0.0;
    if (last) break;
    if (factorized)
      equations.g = next.g;
    else
      equations = std::move(next);
  }
  // Damping is for the step: it would make the weakest directions look known.
  if (damping_of_factor > 0.0) positive = factorize(equations, 0.0);
  if (positive) {
    const Eigen::Index n = rest_.size();
    const Eigen::MatrixXd newest = Eigen::MatrixXd::Identity(n, n).rightCols(15);
    const Eigen::VectorXd tail = scale_.tail(15);
    const Matrix15d block = factor_.solve(newest).bottomRows(15);
    result.covariance = tail.asDiagonal() * block * tail.asDiagonal();
    result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  }
  return result;
}

}  // namespace etalon::fixed_lag
