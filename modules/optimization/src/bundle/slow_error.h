#pragma once

// The accelerometer's slow error within a window as few unknowns, and the sizes of all its errors.
// Private to the module.

#include <Eigen/Core>
#include <vector>

#include "bundle/linearized_residual.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/variance_components.h"

namespace etalon {

/**
 * Modes of the slow error, taken for constant over an interval: its values in the intervals are
 * M z, with z of unit variance and M M^T its covariance but for modes of less than a thousandth of
 * the largest one's variance (Karhunen-Loeve; Rasmussen and Williams, Gaussian Processes for
 * Machine Learning, 4.3).
 * @return M, m/s^2: a row an interval, a column a mode; without columns where there is no slow error
 */
Eigen::MatrixXd slowErrorModes(const std::vector<Preintegration>& preintegrations,
                               const SlowAcceleration& slow);

/**
 * The sizes of the accelerometer's errors after a step of scoring.
 * @param now that the residuals and P were taken at
 * @param residuals all but the pixels; the rows of kind kImu have the white noise, an interval each
 * @param P the inverse of the normal equations
 * @param modes in standard deviations, which stand at `column` of the normal equations
 */
AccelErrorSizes scoredSizes(const AccelErrorSizes& now,
                            const std::vector<LinearizedResidual>& residuals,
                            const Eigen::MatrixXd& P, const Eigen::VectorXd& modes,
                            Eigen::Index column, const SlowAcceleration& slow);

}  // namespace etalon
