#pragma once

#include <Eigen/Core>

#include "etalon/imu/bias_priors.h"

namespace etalon {

/** Standard deviations of the accelerometer's errors in a window, over those that are believed. */
struct AccelErrorSizes {
  AccelErrorSizes() = default;
  explicit AccelErrorSizes(Eigen::Index intervals) : jolts(Eigen::VectorXd::Ones(intervals)) {}

  /** An interval's white noise over what is believed. */
  Eigen::VectorXd whiteByInterval() const { return white * jolts; }

  double slow = 1.0, white = 1.0;
  Eigen::VectorXd jolts;  ///< an interval's white noise over that of all, at least 1
};

/**
 * The sizes after one step of Fisher's scoring of the logarithms t of their variances on the
 * restricted likelihood L (Patterson and Thompson, Biometrika 1971), with Gaussian priors around
 * what is believed. A step changes no variance by more than a factor of exp(1.5), so that what is
 * far off comes closer step by step.
 * @param now that score and information were taken at
 * @param score derivatives of log L by t: of the slow error and of the white noise of every interval
 * @param information their covariance
 */
AccelErrorSizes scoredSizes(const AccelErrorSizes& now, const Eigen::VectorXd& score,
                            const Eigen::MatrixXd& information, const SlowAcceleration& slow);

}  // namespace etalon
