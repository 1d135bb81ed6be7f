#pragma once

// The reduced (Schur complement) information of poses, landmarks eliminated. Private to the module.

#include <Eigen/Core>
#include <vector>

#include "etalon/optimization/visual_window.h"

namespace etalon {

/**
 * Adds the visual information of a window to `H`, landmarks marginalised: the pose of keyframe k
 * stands at `stride * k`, ordered [rotation, position]. Measurements that are not inliers are left
 * out; Huber weights as at the solution.
 */
void addReducedVisualInformation(const VisualWindow& window, const std::vector<SE3>& T_WB,
                                 const std::vector<Eigen::Vector3d>& landmarks,
                                 const std::vector<char>& inlier, double chi2_huber, int stride,
                                 Eigen::MatrixXd* H);

/** Inverse of a symmetric positive definite matrix, symmetrised; empty if it is not numerically so.
 */
Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information);

/**
 * Chi-square relabelling: inlier[i] tells whether measurement i of a valid landmark is below
 * `chi2_threshold`; landmarks left with fewer than two inliers become invalid and lose them.
 * Returns the sum of the inliers' squared residuals.
 */
double relabelMeasurements(const VisualWindow& window, const std::vector<SE3>& T_WB,
                           const std::vector<Eigen::Vector3d>& landmarks, double chi2_threshold,
                           std::vector<char>* landmark_valid, std::vector<char>* inlier);

}  // namespace etalon
