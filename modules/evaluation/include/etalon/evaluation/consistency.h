#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/evaluation/metrics.h"

namespace etalon {

/**
 * Sets `*_nees` of the errors: normalised estimation error squared a degree of freedom, e^T P^-1 e
 * / n, with e as estimationError() has it (Bar-Shalom, Li and Kirubarajan, Estimation with
 * Applications to Tracking and Navigation, 2001, section 5.4). True biases are the ground truth's
 * mean over the keyframes. Left as NaN: what the ground truth does not have, or whose covariance is
 * empty or not positive definite.
 * @param covariance in the order of Initialization::covariance, or empty
 */
void setNees(const std::vector<StampedState>& states, const ImuBias& bias,
             const GroundTruth& ground_truth, const Eigen::MatrixXd& covariance,
             WindowErrors* errors);

}  // namespace etalon
