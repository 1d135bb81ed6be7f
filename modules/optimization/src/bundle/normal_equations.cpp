#include "etalon/optimization/bundle/normal_equations.h"

#include <Eigen/Cholesky>

namespace etalon {

Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information) {
  // Scaled to a unit diagonal first: the blocks' units differ by many orders of magnitude.
  const Eigen::VectorXd diagonal = information.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return {};
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(scale.asDiagonal() * information * scale.asDiagonal());
  if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-15)) return {};
  Eigen::MatrixXd inverse =
      factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  inverse = scale.asDiagonal() * inverse * scale.asDiagonal();
  if (!inverse.allFinite()) return {};
  return 0.5 * (inverse + inverse.transpose());
}

Eigen::MatrixXd covarianceOrEmpty(const Eigen::MatrixXd& curvature, const Eigen::MatrixXd& score) {
  const Eigen::MatrixXd inverse = inverseOrEmpty(curvature);
  if (inverse.size() == 0) return {};
  const Eigen::MatrixXd covariance = inverse * score * inverse;
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace etalon
