#pragma once

// What is left of the residuals of a visual-inertial BA, and what should be left. Private to the
// module.

#include <Eigen/Core>
#include <vector>

#include "bundle/linearized_residual.h"
#include "etalon/optimization/bundle/bundle_problem.h"
#include "etalon/optimization/bundle/noise_check.h"

namespace etalon {

/** The pixels of a solution. */
struct SolvedPixels {
  const VisualWindow& window;
  std::vector<SE3> T_WB;  ///< as the cameras see the body
  const std::vector<BundleLandmark>& landmarks;
  int landmark_unknowns;  ///< of the landmarks that have inliers
  double chi2_pixel;      ///< those below it are the inliers, in sigmas
  double sigma;           ///< of the whitened pixels
};

/**
 * NoiseCheck of a solution; its header says what is counted.
 * @param residuals all but the pixels and what is eliminated with them
 * @param covariance the inverse of the normal equations with exactly these inliers and weights
 */
NoiseCheck checkNoise(const SolvedPixels& pixels, const std::vector<LinearizedResidual>& residuals,
                      const Eigen::MatrixXd& covariance);

/**
 * Variance of the estimate over what the information of the inliers alone says, for residuals as
 * normal as sigma_px promises. Leaving out those beyond `chi2` costs more than their number,
 * because an estimate moves the selection along with itself.
 *
 * Per unit of information, with psi the sum of the residuals kept and r that of all of them, the
 * error is e = r after the first round (Huber's loss costs less than one percent). Each further
 * round selects by the last estimate:  e' = (psi + (p - s) e) / p.
 *
 * Here p is the share kept and s = E[psi^2]; for two dimensions, with q = exp(-chi2 / 2),
 * p = 1 - q and s = 1 - q (1 + chi2 / 2). For two rounds the result is 1.12, for three 1.18.
 */
double truncationFactor(double chi2, int rounds);

/**
 * Mean of the squared norm of a pair of independent N(0, variance) numbers, given that it is below
 * `bound`.
 */
double meanOfTruncatedPair(double variance, double bound);

/** Mean of its minimum with `bound`. */
double meanOfClippedPair(double variance, double bound);

/** The inverse of meanOfClippedPair in the variance; at most 100. */
double varianceOfClippedPairs(double mean, double bound);

}  // namespace etalon
