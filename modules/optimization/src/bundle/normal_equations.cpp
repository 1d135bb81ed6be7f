#include "etalon/optimization/bundle/normal_equations.h"

#include <Eigen/Cholesky>

namespace etalon {

namespace {

/** Of a matrix scaled to a unit diagonal: its blocks' units differ by many orders of magnitude. */
struct ScaledCholesky {
  Eigen::VectorXd scale;
  Eigen::LLT<Eigen::MatrixXd> factor;
  bool determined = false;

  explicit ScaledCholesky(const Eigen::MatrixXd& information) {
    const Eigen::VectorXd diagonal = information.diagonal();
    if (!(diagonal.minCoeff() > 0.0)) return;
    scale = diagonal.cwiseSqrt().cwiseInverse();
    factor.compute(scale.asDiagonal() * information * scale.asDiagonal());
    determined = factor.info() == Eigen::Success && factor.rcond() > 1e-15;
  }
};

}  // namespace

bool isDetermined(const Eigen::MatrixXd& information) {
  return ScaledCholesky(information).determined;
}

Eigen::MatrixXd inverseOrEmpty(const Eigen::MatrixXd& information) {
  const ScaledCholesky scaled(information);
  if (!scaled.determined) return {};
  Eigen::MatrixXd inverse =
      scaled.factor.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  inverse = scaled.scale.asDiagonal() * inverse * scaled.scale.asDiagonal();
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
