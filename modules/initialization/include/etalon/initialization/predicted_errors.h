#pragma once

#include <Eigen/Core>

#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/**
 * The covariance of VI-BA as 11 x 11, in the order of Initialization::covariance: biases,
 * tilt of the first keyframe, velocity of the last one. Empty where VI-BA has none.
 */
Eigen::MatrixXd claimedCovariance(const VisualInertialBaResult& result);

}  // namespace etalon
