#include "etalon/initialization/steps/gravity_alignment.h"

#include "etalon/core/so3.h"

namespace etalon {

Initialization alignWithGravity(const InitializationProblem& problem,
                                const VisualFrameEstimate& estimate) {
  const Eigen::Matrix3d R_WV = rotationBetween(estimate.g_V, -Eigen::Vector3d::UnitZ());
  const SE3 T_WV(R_WV, -(R_WV * estimate.T_VB.front().t));
  Initialization result;
  result.bias = estimate.bias;
  for (size_t k = 0; k < estimate.T_VB.size(); ++k) {
    result.states.emplace_back(problem.keyframe(k).t, T_WV * estimate.T_VB[k],
                               R_WV * estimate.v_VB[k]);
  }
  if (estimate.errors)
    result.covariance =
        estimate.errors->covariance(R_WV, result.states.back().v_WB, problem.gravityMagnitude());
  for (const auto& [id, p_V] : estimate.landmarks) result.landmarks[id] = T_WV * p_V;
  return result;
}

}  // namespace etalon
