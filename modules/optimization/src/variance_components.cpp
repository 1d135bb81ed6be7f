#include "etalon/optimization/variance_components.h"

#include <Eigen/Cholesky>

namespace etalon {

Eigen::VectorXd scoredFactors(Eigen::VectorXd score, Eigen::MatrixXd information,
                              const Eigen::VectorXd& sizes, const Eigen::VectorXd& spread) {
  constexpr double kLargestStep = 1.5, kLeastVariance = 1e-18;
  const Eigen::VectorXd prior = spread.cwiseAbs2().cwiseMax(kLeastVariance).cwiseInverse();
  information.diagonal() += prior;
  score -= 2.0 * prior.cwiseProduct(sizes.array().log().matrix());
  const Eigen::VectorXd step = information.llt().solve(score);
  return (0.5 * step.cwiseMax(-kLargestStep).cwiseMin(kLargestStep)).array().exp();
}

}  // namespace etalon
