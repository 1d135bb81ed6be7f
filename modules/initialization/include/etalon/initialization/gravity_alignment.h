#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"

namespace etalon {

/** What a disjoint initializer has found in the visual frame V: poses, velocities, gravity,
 * landmarks. */
struct VisualFrameEstimate {
  std::vector<SE3> T_VB;
  std::vector<Eigen::Vector3d> v_VB;  ///< m/s, in V
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_V
  ImuBias bias;
};

/**
 * The estimate in the gravity-aligned world: R_WV is the rotation of least angle that takes g_V to
 * -z; the first keyframe is at the origin. Status is kSuccess.
 */
InitializationResult alignWithGravity(const InitializationProblem& problem,
                                      const VisualFrameEstimate& estimate);

}  // namespace etalon
