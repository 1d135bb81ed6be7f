#include "bias_jump.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace etalon::fixed_lag {
namespace {

/** Mean of the newest intervals' inertial terms from which on a look is taken; few frames of a
 * flight without a jump have so much. */
constexpr double kSuspicious = 4.0;

bool isSuspicious(const Window& window) {
  const size_t first = window.firstFull() + 1;
  double cost = 0.0;
  for (size_t i = first; i < window.states.size(); ++i)
    cost += inertialRows(window, i).squaredNorm();
  return first < window.states.size() &&
         cost >= kSuspicious * static_cast<double>(window.states.size() - first);
}

/** Lets the biases walk by a jump's size in the oldest interval. */
void openBiases(Window* window) {
  WindowState& state = window->states[window->firstFull() + 1];
  ImuNoiseDensities noise = state.imu.noise();
  const double per_root_second = 1.0 / std::sqrt(state.imu.dt());
  noise.gyro_random_walk = std::hypot(noise.gyro_random_walk, kGyroJump * per_root_second);
  noise.accel_random_walk = std::hypot(noise.accel_random_walk, kAccelJump * per_root_second);
  state.imu = Preintegration(state.imu.samples(), state.imu.bias(), noise);
  state.imu_sqrt_information = inertialSqrtInformation(state.imu);
}

}  // namespace

bool BiasJumpDetector::isRun(size_t first) const {
  return jumps_.size() >= first + kInARow &&
         secondsBetween(jumps_[first].t, jumps_.back().t) >= kRunS;
}

bool BiasJumpDetector::agreed() const {
  if (!isRun(0)) return false;
  Vector6d mean = Vector6d::Zero();
  for (const Jump& jump : jumps_) mean += jump.size / static_cast<double>(jumps_.size());
  return std::all_of(jumps_.begin(), jumps_.end(),
                     [&](const Jump& jump) { return jump.chi2(jump.size - mean) <= kSameChi2; });
}

std::optional<BiasJumpDetector::Jump> BiasJumpDetector::find(int iterations, WindowSolver* solver,
                                                             const Window& window, Window* open,
                                                             SolverResult* solved) const {
  if (!isSuspicious(window)) return std::nullopt;
  *open = window;
  openBiases(open);
  *solved = solver->solve(open, iterations, true);
  const ImuBias& before = open->states[open->firstFull()].now.bias;
  const ImuBias& after = open->states.back().now.bias;
  Jump jump;
  jump.t = window.states.back().t;
  jump.size << after.gyro - before.gyro, after.accel - before.accel;
  jump.covariance = solved->covariance.block<6, 6>(9, 9);
  if (jump.chi2(jump.size) < chi2_) return std::nullopt;
  return jump;
}

bool BiasJumpDetector::follow(int iterations, WindowSolver* solver, Window* window,
                              SolverResult* solved) {
  Window open;
  SolverResult with_jump;
  const TimeNs t = window->states.back().t;
  if (!calm_since_) calm_since_ = t;
  const std::optional<Jump> jump = find(iterations, solver, *window, &open, &with_jump);
  if (!jump) {
    if (!jumps_.empty()) calm_since_ = t;
    jumps_.clear();
    return false;
  }
  if (jumps_.empty()) was_calm_ = secondsBetween(*calm_since_, t) >= kCalmS;
  jumps_.push_back(*jump);
  while (isRun(1)) jumps_.pop_front();
  if (!was_calm_ || !agreed()) return false;
  jumps_.clear();
  calm_since_ = t;
  *window = std::move(open);
  *solved = with_jump;
  return true;
}

}  // namespace etalon::fixed_lag
