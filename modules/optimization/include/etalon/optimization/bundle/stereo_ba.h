#pragma once

#include <vector>

#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

struct StereoBaOptions {
  int rounds = 2;  ///< optimise, relabel outliers, optimise again
  int iterations_per_round = 10;
  double chi2_threshold = kChi2Pixel;  ///< of a pixel; its root is the Huber width
  bool compute_covariance = false;
};

struct StereoBaResult {
  std::vector<SE3> T_VB;
  std::vector<Eigen::Vector3d> landmarks;  ///< p_V, in the window's order
  std::vector<char> landmark_valid;        ///< has at least two inlier measurements
  std::vector<char> inlier;                ///< one a measurement
  double rms_px_over_sigma = 0.0;          ///< whitened RMS of the inliers, per coordinate
  int iterations = 0;
  Eigen::MatrixXd covariance;  ///< as VisualSolution::covariance
};

/**
 * Bundle adjustment of all poses but the first (fixed) and all landmarks: stereo odometry of every
 * disjoint initializer. Ceres, Levenberg-Marquardt with a dense Schur complement, one thread,
 * bit-identical from run to run.
 * @param landmark_valid which landmarks have a starting value; the others are left out
 */
StereoBaResult solveStereoBa(const VisualWindow& window, const std::vector<SE3>& T_VB,
                             const std::vector<Eigen::Vector3d>& landmarks,
                             const std::vector<char>& landmark_valid,
                             const StereoBaOptions& options = {});

}  // namespace etalon
