#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/initialization/steps/state_errors.h"

namespace etalon {

/** What a disjoint initializer has found in the visual frame V: poses, velocities, gravity,
 * landmarks. */
struct VisualFrameEstimate {
  std::vector<SE3> T_VB;
  std::vector<Eigen::Vector3d> v_VB;  ///< m/s, in V
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_V
  ImuBias bias;
  std::optional<StateErrors> errors;  ///< for the covariance
};

/** Refused (implausible) where the accelerometer measures so little on average, m/s^2, that there is
 * no telling where down is. */
Expected<void> checkMeanSpecificForce(double mean_mps2, double gravity_mps2);

/** Refused (ill_conditioned) where gravity's direction is known worse than wanted.
 * @param sigma_rad of its weakest direction */
Expected<void> checkGravityDirection(double sigma_rad, double max_sigma_deg);

/**
 * The estimate in the gravity-aligned world: R_WV is the rotation of least angle that takes g_V to
 * -z; the first keyframe is at the origin. Where the estimate has its errors,
 * the result has their covariance.
 */
Initialization alignWithGravity(const InitializationProblem& problem,
                                const VisualFrameEstimate& estimate);

}  // namespace etalon
