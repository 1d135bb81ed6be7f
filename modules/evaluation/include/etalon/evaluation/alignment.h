#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"

namespace etalon {

/** Which transformations an alignment may use. */
enum class AlignmentType {
  kSE3,          ///< rotation and translation
  kSim3,         ///< rotation, translation and scale
  kYawPosition,  ///< rotation about z and translation: what visual-inertial odometry cannot observe
};

/** p_G = scale R p_W + t, with T_GW = (R, t): the estimate's world W to the ground truth's world G.
 */
struct Alignment {
  SE3 T_GW;
  double scale = 1.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_W) const {
    return scale * (T_GW.R * p_W) + T_GW.t;
  }
  /** T_WB to T_GB: the position is scaled, the rotation is not. */
  SE3 operator*(const SE3& T_WB) const { return {T_GW.R * T_WB.R, *this * T_WB.t}; }
};

/**
 * The alignment that minimises sum |p_G - scale R p_W - t|^2 (Umeyama, PAMI 1991; for kYawPosition
 * the angle in closed form). Where the points leave a part of the rotation undetermined (fewer than
 * three, or in a line), one of the minimisers is returned; where they leave the scale undetermined
 * (they coincide), the scale is 1.
 *
 * @param p_G,p_W corresponding points, m; same size, not empty
 * @throws Error if the sizes differ, there is no point, or a coordinate is not finite
 */
Alignment alignPoints(const std::vector<Eigen::Vector3d>& p_G,
                      const std::vector<Eigen::Vector3d>& p_W, AlignmentType type);

/** Every pose of `trajectory` moved by `alignment`. */
Trajectory transformed(const Trajectory& trajectory, const Alignment& alignment);

}  // namespace etalon
