#include "etalon/initialization/steps/visual_inertial_problem.h"

namespace etalon {

VisualInertialProblem visualInertialProblem(const InitializationProblem& problem,
                                            const Initialization& start) {
  VisualInertialProblem result;
  std::vector<SE3> poses;
  for (const StampedState& state : start.states) {
    result.states.push_back(state);
    poses.push_back(state.T_WB);
  }
  result.bundle = BundleProblem(
      buildVisualWindow(problem.calibration(), problem.keyframes(), problem.sigmaPx()),
      start.landmarks);
  result.bundle.triangulateMissing(poses);
  result.preintegrations =
      problem.preintegrate(start.bias, problem.priors().slow_accel.white(problem.imuNoise()));
  result.bias = start.bias;
  result.priors = problem.priors();
  result.gravity_mps2 = problem.gravityMagnitude();
  return result;
}

}  // namespace etalon
