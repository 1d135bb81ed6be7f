#pragma once

// What is left of the residuals of a visual-inertial BA, and what should be left. Private to the
// module.

#include <Eigen/Core>
#include <vector>

#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/**
 * One inertial residual at the solution, whitened by C^-1 with C lower triangular and C C^T the
 * covariance in the order [rotation, position, velocity]: the first three rows are the rotation's,
 * which is the gyro's alone; the other six are position and velocity given the rotation.
 */
struct InertialResidual {
  Eigen::Matrix<double, 9, 1> r;
  Eigen::Matrix<double, 9, 24> J;  ///< by [state k (9), state k+1 (9), b_g, b_a]
  double weight = 1.0;             ///< Huber's in the normal equations
};

/** What the normal equations of the solution were made of. */
struct SolvedWindow {
  const VisualWindow& window;
  std::vector<SE3> T_WB;
  const std::vector<Eigen::Vector3d>& landmarks;
  const std::vector<char>& inlier;  ///< one a measurement
  int landmark_unknowns;            ///< of the landmarks that have inliers
  double chi2_pixel;                ///< those below it are the inliers
  double prior_sigma_gyro_rps, prior_sigma_accel_mps2;
};

/**
 * NoiseCheck of a solution; its header says what is counted.
 * @param inertial one a pair of keyframes
 * @param covariance (9N+6) square: the inverse of the normal equations with exactly these inliers
 *        and weights, gauge (4) fixed by pseudo-measurements
 */
NoiseCheck checkNoise(const SolvedWindow& solved, const std::vector<InertialResidual>& inertial,
                      const Eigen::MatrixXd& covariance);

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
