#pragma once

// Biases that jump. Private to the module.

#include <optional>

#include "window_solver.h"

namespace etalon::fixed_lag {

constexpr double kGyroJump = 0.02;  ///< standard deviation of a jump, rad/s
constexpr double kAccelJump = 0.3;  ///< m/s^2

/**
 * Biases walk slowly; a shock, a change of range or a supply that drops makes them jump, and images
 * and IMU contradict each other from then on. A generalised likelihood ratio decides (Willsky and
 * Jones, A generalized likelihood ratio approach to the detection and estimation of jumps in linear
 * systems, IEEE TAC 1976): where kInARow frames running the window's cost falls by more than a
 * threshold when the biases may have changed by kGyroJump and kAccelJump in each of the newest
 * intervals, they have. A single interval whose samples are wrong is no jump. Nor is it one where
 * the same was seen within the kCalm frames before, with stamps that jitter, say, or where it
 * happens again within kAgainS.
 */
class BiasJumpDetector {
 public:
  static constexpr int kInARow = 4, kCalm = 20;
  static constexpr double kAgainS = 10.0;

  /** @param chi2 the threshold */
  explicit BiasJumpDetector(double chi2) : chi2_(chi2) {}

  /**
   * To be asked once a frame, after the solution.
   * @param iterations of the solver
   * @param solved of the window as it is; where the biases have jumped both are replaced by the
   *        solution in which they may have
   * @return whether the biases have jumped
   */
  bool follow(int iterations, WindowSolver* solver, Window* window, SolverResult* solved);

 private:
  double chi2_;
  int in_a_row_ = 0;
  int calm_ = 0;                ///< frames before these whose cost did not fall so
  std::optional<TimeNs> last_;  ///< jump that was followed
};

}  // namespace etalon::fixed_lag
