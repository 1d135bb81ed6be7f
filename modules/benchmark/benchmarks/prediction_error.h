#pragma once

#include <vector>

#include "etalon/core/se3.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/**
 * How well poses predict pixels that were not used (cross-validation): every measurement of
 * `window` is left out in turn with all that its keyframe sees of the landmark, the landmark is
 * triangulated from its other keyframes (robustly, the poses held fixed), and projected.
 * A rigid motion of all poses changes nothing.
 *
 * @param window built with sigma_px
 * @param T_WB poses of the window's keyframes
 * @return a measurement's distance from its prediction, px, in the window's order; NaN where there
 *         is none: fewer than two other keyframes, or they do not determine the landmark
 */
std::vector<double> predictionErrors(const VisualWindow& window, double sigma_px,
                                     const std::vector<SE3>& T_WB);

}  // namespace etalon
