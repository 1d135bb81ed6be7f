#pragma once

// What the accelerometer's slow error adds to the covariance of the gradient. Private to the module.

#include <vector>

#include "bundle/residual_list.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

/**
 * Adds to `score` the covariance of the gradient by the slow error (SlowAcceleration), constant over
 * an interval: there it acts as b_a does.
 * @param residuals of which the k-th of kind kImu is that of the k-th preintegration
 * @param accel_column of b_a in the normal equations
 */
void addSlowError(const std::vector<LinearizedResidual>& residuals,
                  const std::vector<Preintegration>& preintegrations, const SlowAcceleration& slow,
                  Eigen::Index accel_column, Eigen::MatrixXd* score);

}  // namespace etalon
