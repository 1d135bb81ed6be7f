#pragma once

#include <map>
#include <vector>

#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** Where a bundle adjustment starts from: a position for every landmark of a window that has one.
 */
struct StartingLandmarks {
  std::vector<Eigen::Vector3d> positions;  ///< m, in the window's order; zero where not valid
  std::vector<char> valid;
};

/** Positions of those landmarks of `window` that `known` holds. */
StartingLandmarks startingLandmarks(const VisualWindow& window,
                                    const std::map<LandmarkId, Eigen::Vector3d>& known);

/** Triangulates, from the poses T_WB, the landmarks of `window` that have no position yet. */
void triangulateMissing(const VisualWindow& window, const std::vector<SE3>& T_WB,
                        StartingLandmarks* landmarks);

}  // namespace etalon
