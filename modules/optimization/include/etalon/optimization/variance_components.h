#pragma once

#include <Eigen/Core>

namespace etalon {

/**
 * One step of Fisher's scoring of the logarithms t of variances on their restricted likelihood
 * (Patterson and Thompson, Biometrika 1971), with Gaussian priors: what the standard deviations are
 * to be multiplied by. A step changes no variance by more than a factor of exp(1.5), so that what is
 * far off comes closer step by step.
 * @param score derivatives of log L by t
 * @param information their covariance
 * @param sizes standard deviations over those that are believed
 * @param spread of the prior on t; zero: the size stays
 */
Eigen::VectorXd scoredFactors(Eigen::VectorXd score, Eigen::MatrixXd information,
                              const Eigen::VectorXd& sizes, const Eigen::VectorXd& spread);

}  // namespace etalon
