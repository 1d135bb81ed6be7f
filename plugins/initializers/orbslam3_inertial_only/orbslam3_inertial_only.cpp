#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/inertial_only_step.h"

namespace etalon::plugins {

/**
 * ORB-SLAM3's stereo-inertial initialization: the inertial-only MAP on the poses of stereo
 * odometry, which stay as they are (Campos et al., ICRA 2020; README.md beside this file).
 */
class OrbSlam3InertialOnly : public Initializer {
  DEFINE_MRPT_OBJECT(OrbSlam3InertialOnly, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override { options_.declare(parameters); }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const Expected<VisualSolution>& visual = problem.visualSolution();
    if (!visual) return refuse(visual.error());
    Stopwatch watch;
    const Expected<InertialOnlyStep> step = solveInertialOnlyStep(problem, options_);
    if (!step) return refuse(step.error());
    VisualFrameEstimate estimate;
    estimate.T_VB = visual->T_VB;
    estimate.v_VB = step->map.v_VB;
    estimate.g_V = step->map.g_V;
    estimate.bias = step->map.bias;
    estimate.landmarks = visual->landmarks;
    estimate.errors = step->errors;
    Initialization result = alignWithGravity(problem, estimate);
    result.timings.push_back({"inertial_only_map", watch.lapMilliseconds()});
    return result;
  }

 private:
  InertialOnlyStepOptions options_;
};

IMPLEMENTS_MRPT_OBJECT(OrbSlam3InertialOnly, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(
    OrbSlam3InertialOnly, etalon::plugins, "orbslam3_inertial_only", "1.0",
    "inertial-only MAP on the poses of stereo odometry (Campos et al. 2020)")
