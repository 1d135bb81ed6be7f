#pragma once

// The reduced (Schur complement) information of poses, landmarks eliminated. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/**
 * Normal equations of the poses and of what else the caller adds, landmarks eliminated, twice:
 *
 *   score      Gauss-Newton's matrix: the covariance of the gradient at the truth,
 *   curvature  the second derivatives of the cost: what the gradient grows by with an error.
 *
 * They differ by one term of the visual part, the residual times the mixed derivative by inverse
 * depth and position. Far landmarks need it: parallax that is noise looks like information to
 * Gauss-Newton (a baseline times an inverse depth that was fitted to the same noise), and the
 * curvature does not have it. Every other second derivative is smaller than what stands beside it
 * by the size of a residual, about 1e-3 rad. (Positions relative to the first pose that saw the
 * landmark, in its body's frame: moving all together changes no term.)
 *
 * The covariance of the estimate is curvature^-1 score curvature^-1 (Huber, The behavior of maximum
 * likelihood estimates under nonstandard conditions, 1967); with near landmarks the two agree and
 * it is the inverse of either.
 */
struct NormalEquations {
  explicit NormalEquations(Eigen::Index size)
      : score(Eigen::MatrixXd::Zero(size, size)), curvature(score) {}
  Eigen::MatrixXd score, curvature;

  /** Adds to both at (row, column) what the residuals of no landmark contribute. */
  template <typename Derived>
  void add(Eigen::Index row, Eigen::Index column, const Eigen::MatrixBase<Derived>& block) {
    score.block(row, column, block.rows(), block.cols()) += block;
    curvature.block(row, column, block.rows(), block.cols()) += block;
  }
};

/** A landmark of the normal equations: `held` where its rho is no unknown. */
struct LandmarkEstimates {
  const std::vector<InverseDepthLandmark>& landmarks;
  const std::vector<char>& held;
};

/**
 * Adds the visual information of a window, landmarks marginalised: the pose of keyframe k stands at
 * `stride * k`, ordered [rotation, position]. Measurements that are not inliers are left out; Huber
 * weights as at the solution.
 */
void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const LandmarkEstimates& estimates,
                                 const std::vector<char>& inlier, double chi2_huber, int stride,
                                 NormalEquations* equations);

/**
 * Allows every pose an error of its own, Gaussian with the inverse covariance diag(`information`)
 * (as long as the equations), and eliminates it: with C the curvature, S the score, W the
 * information and K = (C + W)^-1, the curvature becomes W K C and the score
 * W K S K W + C K W K C.
 */
void eliminateErrors(const Eigen::VectorXd& information, NormalEquations* equations);

/** Inverse of a symmetric positive definite matrix, symmetrised; empty if it is not numerically so.
 */
Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information);

/** curvature^-1 score curvature^-1; empty if the curvature is not positive definite. */
Eigen::MatrixXd covarianceOrEmpty(const Eigen::MatrixXd& curvature, const Eigen::MatrixXd& score);

/**
 * Chi-square relabelling: inlier[i] tells whether measurement i of a valid landmark is below
 * `chi2_threshold`; landmarks left with fewer than two inliers become invalid and lose them.
 * Returns the sum of the inliers' squared residuals.
 */
double relabelMeasurements(const VisualWindow& window, const std::vector<SE3>& T_WB,
                           const std::vector<Eigen::Vector3d>& landmarks, double chi2_threshold,
                           std::vector<char>* landmark_valid, std::vector<char>* inlier);

}  // namespace etalon
