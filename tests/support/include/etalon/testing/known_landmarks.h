#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "etalon/core/tracked_frame.h"

namespace etalon::testing {

/** Points as a BundleProblem takes them; a synthetic window's landmark i has the id i. */
inline std::map<LandmarkId, Eigen::Vector3d> knownLandmarks(
    const std::vector<Eigen::Vector3d>& points) {
  std::map<LandmarkId, Eigen::Vector3d> known;
  for (const Eigen::Vector3d& p : points) known.emplace(static_cast<LandmarkId>(known.size()), p);
  return known;
}

}  // namespace etalon::testing
