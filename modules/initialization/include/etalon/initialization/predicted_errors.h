#pragma once

#include <Eigen/Core>

#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/**
 * The covariance of VI-BA as 11 x 11, in the order of Initialization::covariance: biases,
 * tilt of the first keyframe, velocity of the last one. Empty where VI-BA has none.
 */
Eigen::MatrixXd claimedCovariance(const VisualInertialBaResult& result);

/** The same with the poses relative to the first, 11 + 6(N-1) square. */
Eigen::MatrixXd claimedJointCovariance(const VisualInertialBaResult& result);

/** An error that is predicted: its length stays below `bound` at a confidence. */
struct PredictedError {
  double bound = 0.0;                    ///< in the unit of the error
  Eigen::VectorXd worst;                 ///< unit vector along which it is largest
  bool alike_in_all_directions = false;  ///< no direction is worse than another by a quarter
};

/**
 * The length that an error e ~ N(0, covariance) keeps with probability `confidence`. Mean and
 * variance of e^T e are tr P and 2 tr P^2, those of (tr P^2 / tr P) times a chi-square variable of
 * (tr P)^2 / tr P^2 degrees of freedom (Satterthwaite, Biometrics 1946), whose quantile it is: exact
 * for one direction and for directions that are all alike.
 * @param covariance not empty, positive semidefinite; where it is not finite the bound is infinite
 */
PredictedError predictedError(const Eigen::MatrixXd& covariance, double confidence);

/** Standard deviation of the weakest direction, which need be no axis. @param covariance not empty,
 * finite */
double largestSigma(const Eigen::MatrixXd& covariance);

}  // namespace etalon
