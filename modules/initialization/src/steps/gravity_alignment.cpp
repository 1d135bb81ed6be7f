#include "etalon/initialization/steps/gravity_alignment.h"

#include <algorithm>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"

namespace etalon {

Expected<void> checkMeanSpecificForce(double mean_mps2, double gravity_mps2) {
  constexpr double kLeastShare = 0.1;  // of gravity
  const double least = kLeastShare * gravity_mps2;
  if (mean_mps2 >= least) return {};
  return refuse(RefusalStatus::kImplausible, "the accelerometer measures ", Value(mean_mps2, 3),
                " m/s^2 on average, which leaves no direction for gravity; at least ",
                Bound(least, 3), " m/s^2 are wanted");
}

Expected<void> checkGravityDirection(double sigma_rad, double max_sigma_deg) {
  constexpr double kNotKnown = 180.0;  // no direction is farther from another
  const double sigma_deg = degrees(sigma_rad);
  if (sigma_deg <= max_sigma_deg) return {};
  return refuse(RefusalStatus::kIllConditioned, "the gravity direction is known to ",
                Value(std::min(sigma_deg, kNotKnown), 2), " deg (1 sigma), at most ",
                Bound(max_sigma_deg, 2), " is wanted");
}

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
