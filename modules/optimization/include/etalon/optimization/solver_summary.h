#pragma once

#include <string>

namespace etalon {

/** How an iterative solver ended, and what has become of the state that it was given. */
enum class Termination {
  /** Too little to begin with, such as no landmark that agrees with the start: the state is as it
   * was given. */
  kNotStarted,
  /** The solver's own criterion, a short step or a small decrease, is met: the state is the
   * solution. */
  kConverged,
  /** The iterations are used up: the state is the last one, and no worse than the one given. */
  kMaxIterations,
  /** The data do not determine the state: it is the last one that they did determine. */
  kSingular,
  /** The caller told it to stop: the state is as it was given. */
  kStopped,
  /** Something is not finite, or nothing is left to fit: the state is of no use. */
  kFailed,
};

/** "converged", "max_iterations" and so on. */
const char* toString(Termination termination);

/** What every iterative solver says of its run. */
struct SolverSummary {
  Termination termination = Termination::kNotStarted;
  int iterations = 0;  ///< summed over the rounds
  /** Half the sum of squared whitened residuals, with the robust loss where there is one: at the
   * start, and at the state returned with what counted as an inlier in the last round. */
  double initial_cost = 0.0, final_cost = 0.0;
  std::string message;  ///< why it ended; empty where the state is of use

  bool converged() const { return termination == Termination::kConverged; }
  /** The state is the solution, or on the way there. */
  bool usable() const { return converged() || termination == Termination::kMaxIterations; }

  /** Ends the run with a reason. */
  void stop(Termination how, std::string why) {
    termination = how;
    message = std::move(why);
  }
};

}  // namespace etalon
