#pragma once

// When a run of Ceres has converged. Private to the module.

#include <ceres/iteration_callback.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace etalon {

/**
 * Ends a run by the length of the step in its own standard deviations: the square of that is twice
 * the decrease that the step promises (g^T H^-1 g, Newton's decrement). The relative decrease of
 * the cost is blind to what few residuals determine, such as gravity at rest.
 */
class StepWatch : public ceres::IterationCallback {
 public:
  /** Inverse of the damping relative to the diagonal. Above this value not even the weakest
   * direction, gravity against b_a, is held back. */
  static constexpr double kUndamped = 1e7;

  explicit StepWatch(double converged_sigmas) : converged_sigmas_(converged_sigmas) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration == 0 || !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    // relative_decrease is the ratio of the actual to the promised decrease.
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

}  // namespace etalon
