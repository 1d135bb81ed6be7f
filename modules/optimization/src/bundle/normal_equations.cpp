#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon {

ScaledCholesky::ScaledCholesky(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd diagonal = information.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return;
  scale_ = diagonal.cwiseSqrt().cwiseInverse();
  factor_.compute(scale_.asDiagonal() * information * scale_.asDiagonal());
  determined_ = factor_.info() == Eigen::Success && factor_.rcond() > 1e-15;
}

Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information) {
  const ScaledCholesky factor(information);
  if (!factor.determined()) return {};
  const Eigen::MatrixXd inverse =
      factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  if (!inverse.allFinite()) return {};
  return 0.5 * (inverse + inverse.transpose());
}

Eigen::MatrixXd covarianceOrEmpty(const Eigen::MatrixXd& curvature, const Eigen::MatrixXd& score) {
  const Eigen::MatrixXd inverse = inverseOrEmpty(curvature);
  if (inverse.size() == 0) return {};
  const Eigen::MatrixXd covariance = inverse * score * inverse;
  if (!covariance.allFinite()) return {};
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace etalon
