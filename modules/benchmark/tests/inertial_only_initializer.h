#pragma once

#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/inertial_only_step.h"

namespace etalon::noise_test {

/** The inertial-only initializer without a plugin: stereo odometry, then the inertial-only MAP. */
class TestInitializer : public Initializer {
  DEFINE_MRPT_OBJECT(TestInitializer, etalon::noise_test)

 public:
  void declareParameters(ParameterSet&) override {}
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const Expected<InertialOnlyStep> step = solveInertialOnlyStep(problem, {});
    if (!step) return refuse(step.error());
    const VisualSolution& visual = *problem.visualSolution();
    return alignWithGravity(
        problem,
        {visual.T_VB, step->map.v_VB, step->map.g_V, visual.landmarks, step->map.bias, {}});
  }
};

}  // namespace etalon::noise_test
