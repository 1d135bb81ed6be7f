#pragma once

// The landmarks of a window as bearing and inverse depth. Private to the module.

#include <vector>

#include "etalon/optimization/bundle/bundle_problem.h"

namespace etalon {

/** One a landmark of the window, each about the place of the camera that saw it first, as given. */
struct WindowLandmarks {
  WindowLandmarks(const BundleProblem& bundle, const std::vector<SE3>& T_WB);

  /**
   * Sets rho >= 0 and decides which landmarks are held at infinity: those at rho = 0 whose inliers'
   * residuals do not want them nearer (an active set for rho >= 0).
   */
  void holdAtInfinity(const VisualWindow& window, const std::vector<SE3>& T_WB);
  /** Stores the positions in a bundle problem of the same window. */
  void store(BundleProblem* bundle) const;

  std::vector<InverseDepthLandmark> landmarks;
  std::vector<char> held;  ///< where true, rho is zero and no unknown
};

}  // namespace etalon
