#pragma once

// The reduced (Schur complement) information of poses, landmarks eliminated.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "etalon/optimization/bundle/normal_equations.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** What a robust loss makes of a measurement: the gradient holds `gradient` times its residual, the
 * second derivatives `curvature` times the square of its derivative. Both 0: left out. */
struct RobustWeight {
  double gradient = 0.0, curvature = 0.0;
};
/** Of a measurement of the window with the squared residual r2. */
using RobustWeights = std::function<RobustWeight(const VisualMeasurement&, double r2)>;

/** Huber's loss for inliers; what is not an inlier is left out.
 * @param width in sigmas
 * @param sigma of the whitened pixels: 1 where they are as noisy as believed */
RobustWeights huberOfInliers(double width, double sigma = 1.0);

/** A landmark of the normal equations: `held` where its rho is no unknown. */
struct LandmarkEstimates {
  const std::vector<InverseDepthLandmark>& landmarks;
  const std::vector<char>& held;
};

/**
 * Adds the visual information of a window, landmarks marginalised: six rows a keyframe, [rotation,
 * position].
 */
void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const LandmarkEstimates& estimates, const RobustWeights& weights,
                                 NormalEquations* equations);

/**
 * Allows every pose an error of its own, Gaussian with the inverse covariance diag(`information`)
 * (as long as the equations), and eliminates it: with C the curvature, S the score, W the
 * information and K = (C + W)^-1, the curvature becomes W K C and the score
 * W K S K W + C K W K C.
 */
void eliminateErrors(const Eigen::VectorXd& information, NormalEquations* equations);

}  // namespace etalon
