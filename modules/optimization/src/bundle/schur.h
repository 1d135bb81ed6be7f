#pragma once

// The reduced (Schur complement) information of poses, landmarks eliminated. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "bundle/normal_equations.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** A landmark of the normal equations: `held` where its rho is no unknown. */
struct LandmarkEstimates {
  const std::vector<InverseDepthLandmark>& landmarks;
  const std::vector<char>& held;
};

/**
 * Adds the visual information of a window, landmarks marginalised: the pose of keyframe k stands at
 * `stride * k`, ordered [rotation, position]. Measurements that are not inliers are left out; Huber
 * weights as at the solution.
 * @param huber its width in sigmas
 */
void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const LandmarkEstimates& estimates, double huber, int stride,
                                 NormalEquations* equations);

/**
 * Allows every pose an error of its own, Gaussian with the inverse covariance diag(`information`)
 * (as long as the equations), and eliminates it: with C the curvature, S the score, W the
 * information and K = (C + W)^-1, the curvature becomes W K C and the score
 * W K S K W + C K W K C.
 */
void eliminateErrors(const Eigen::VectorXd& information, NormalEquations* equations);

}  // namespace etalon
