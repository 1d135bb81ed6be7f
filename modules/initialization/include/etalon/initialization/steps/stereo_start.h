#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** Median per axis, of one point at least. */
Eigen::Vector3d medianOf(const std::vector<Eigen::Vector3d>& points);

/** Landmarks from both cameras of single frames, in the body frame of each. */
struct StereoPoints {
  struct Point {
    int keyframe = 0;
    Eigen::Vector3d p_B;  ///< m
  };
  std::vector<std::vector<Point>> of_landmark;  ///< index as the window's landmarks
};

/** Frames whose two rays miss each other (squared residual above `max_chi2`) give no point. */
StereoPoints stereoPoints(const VisualWindow& window, double max_chi2);

/**
 * Gyro bias from how the stereo points of neighbouring keyframes turn, for a start: a landmark seen
 * at p in keyframe k-1 and at q in k says p = t_k + dR_k Exp(J_k b) q, linear in t_k and the change
 * b of the bias. The sum of the residuals' norms is minimised (iterated weights; outliers have a
 * bounded pull), whitened by what a pixel does to p: the distance across the ray, its square over
 * the baseline along it.
 *
 * @param sigma_prior_rps of b_g around the preintegrations' own: holds what the points do not say
 */
Eigen::Vector3d gyroBiasOfPoints(const StereoPoints& points,
                                 const std::vector<Preintegration>& preintegrations,
                                 double baseline_m, double sigma_prior_rps);

/**
 * Positions from the stereo points under given rotations: step by step the median, per axis, of
 * what the landmarks common to two frames say of the step. Coarse, but not moved by outliers.
 */
std::vector<SE3> medianPositions(const StereoPoints& points,
                                 const std::vector<Eigen::Matrix3d>& R_VB);

}  // namespace etalon
