#include "etalon/optimization/solver_summary.h"

namespace etalon {

const char* toString(Termination termination) {
  switch (termination) {
    case Termination::kNotStarted:
      return "not_started";
    case Termination::kConverged:
      return "converged";
    case Termination::kMaxIterations:
      return "max_iterations";
    case Termination::kSingular:
      return "singular";
    case Termination::kStopped:
      return "stopped";
    case Termination::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace etalon
