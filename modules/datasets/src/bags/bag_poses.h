#pragma once

#include <Eigen/Geometry>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/se3.h"

namespace etalon {

/** A message's pose. @param path of the bag, for the message @throws DataError if the quaternion
 * is not of unit length */
inline SE3 poseOfMessage(const Eigen::Vector3d& p, const Eigen::Quaterniond& q,
                         const std::string& path) {
  constexpr double kUnit = 1e-3;
  if (!p.allFinite() || !(std::abs(q.norm() - 1.0) < kUnit))
    throw DataError(path, 0, "expected poses of finite positions and quaternions of unit length");
  return {q.normalized().toRotationMatrix(), p};
}

}  // namespace etalon
