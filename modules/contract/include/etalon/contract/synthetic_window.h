#pragma once

#include <vector>

#include "etalon/evaluation/metrics.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/synthetic_window.h"

namespace etalon::testing {

using etalon::eurocCalibration;
using etalon::WindowErrors;

/** The window as an initialization problem whose visual solution is the project's stereo odometry.
 */
InitializationProblem makeProblem(const SyntheticWindow& window,
                                  const SyntheticWindowOptions& options);

/** Errors of keyframe states against the window's truth, see evaluateWindow(). */
WindowErrors errorsOf(const std::vector<StampedState>& states, const ImuBias& bias,
                      const SyntheticWindow& window);

/** Estimate less the window's truth, see estimationError() in the initialization module. */
Eigen::Matrix<double, 11, 1> estimationError(const Initialization& result,
                                             const SyntheticWindow& window);

}  // namespace etalon::testing
