#pragma once

// Biases that jump. Private to the module.

#include <deque>
#include <optional>

#include "window_solver.h"

namespace etalon::fixed_lag {

constexpr double kGyroJump = 0.02;  ///< standard deviation of a jump, rad/s
constexpr double kAccelJump = 0.3;  ///< m/s^2

/**
 * Biases walk slowly; a shock, a change of range or a supply that drops makes them jump, and images
 * and IMU contradict each other from then on. Where the window's inertial terms are large the window
 * is solved once more with biases that may have changed by kGyroJump and kAccelJump in its oldest
 * interval (the jump as an unknown of its own: Willsky and Jones, A generalized likelihood ratio
 * approach to the detection and estimation of jumps in linear systems, IEEE TAC 1976). They have
 * jumped where kInARow frames running, of kRunS at least, find a jump, all of them the same one,
 * after kCalmS in which none found any: a knock, stamps that jitter or a delay show another jump, or
 * its opposite, a frame later, and a wrong calibration shows its own all the time.
 */
class BiasJumpDetector {
 public:
  static constexpr size_t kInARow = 6;
  static constexpr double kRunS = 0.24, kCalmS = 1.04;  // s
  /** Of a frame's jump about the mean, at most: the 95 % quantile of 6 degrees of freedom. */
  static constexpr double kSameChi2 = 12.6;

  /** @param chi2 of a jump that is believed, in each frame, at least */
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
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  /** Of the biases in one frame: gyro (rad/s), accelerometer (m/s^2). */
  struct Jump {
    TimeNs t;
    Vector6d size;
    Eigen::Matrix<double, 6, 6> covariance;

    double chi2(const Vector6d& d) const { return d.dot(covariance.ldlt().solve(d)); }
  };

  /** The jump that the newest frame shows, if any; `open` and `solved` with biases that may have. */
  std::optional<Jump> find(int iterations, WindowSolver* solver, const Window& window, Window* open,
                           SolverResult* solved) const;
  /** Whether the newest frames from `first` on are as many, and of such a time, as are asked. */
  bool isRun(size_t first) const;
  /** Whether the newest frames agree on a jump. */
  bool agreed() const;

  double chi2_;
  std::deque<Jump> jumps_;            ///< of the newest frames, without a gap
  std::optional<TimeNs> calm_since_;  ///< since this frame none but these found any
  bool was_calm_ = false;             ///< for kCalmS before these
};

}  // namespace etalon::fixed_lag
