#include "bias_jump.h"

#include <cmath>
#include <utility>

namespace etalon::fixed_lag {
namespace {

/** Inertial terms of the newest intervals, together, from which on a look is taken; few frames of a
 * flight without a jump have so much. */
constexpr double kSuspicious = 12.0;

double inertialCost(const Window& window) {
  double cost = 0.0;
  for (size_t i = window.firstFull() + 1; i < window.states.size(); ++i)
    cost += inertialRows(window, i).squaredNorm();
  return cost;
}

/** Lets the biases walk by a jump's size in each interval. */
void openBiases(Window* window) {
  for (size_t i = window->firstFull() + 1; i < window->states.size(); ++i) {
    WindowState& state = window->states[i];
    ImuNoiseDensities noise = state.imu.noise();
    const double per_root_second = 1.0 / std::sqrt(state.imu.dt());
    noise.gyro_random_walk = std::hypot(noise.gyro_random_walk, kGyroJump * per_root_second);
    noise.accel_random_walk = std::hypot(noise.accel_random_walk, kAccelJump * per_root_second);
    state.imu = Preintegration(state.imu.samples(), state.imu.bias(), noise);
    state.imu_sqrt_information = inertialSqrtInformation(state.imu);
  }
}

}  // namespace

bool BiasJumpDetector::follow(int iterations, WindowSolver* solver, Window* window,
                              SolverResult* solved) {
  const TimeNs t = window->states.back().t;
  if (last_ && secondsBetween(*last_, t) < kAgainS) return false;
  Window open;
  SolverResult with_jump = *solved;
  if (inertialCost(*window) >= kSuspicious) {
    open = *window;
    openBiases(&open);
    with_jump = solver->solve(&open, iterations, true);
  }
  if (solved->cost - with_jump.cost < chi2_) {
    calm_ = in_a_row_ > 0 ? 1 : calm_ + 1;
    in_a_row_ = 0;
    return false;
  }
  if (calm_ < kCalm) {
    calm_ = 0;
    return false;
  }
  if (++in_a_row_ < kInARow) return false;
  in_a_row_ = calm_ = 0;
  last_ = t;
  *window = std::move(open);
  *solved = with_jump;
  return true;
}

}  // namespace etalon::fixed_lag
