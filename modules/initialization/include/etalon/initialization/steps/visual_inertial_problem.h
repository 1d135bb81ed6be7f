#pragma once

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/** The bundle adjustment of a problem's keyframes from what an initializer found: its landmarks, the
 * others triangulated from its poses; the IMU integrated at its biases. */
VisualInertialProblem visualInertialProblem(const InitializationProblem& problem,
                                            const Initialization& start);

}  // namespace etalon
