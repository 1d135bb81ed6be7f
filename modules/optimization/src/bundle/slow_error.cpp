#include "bundle/slow_error.h"

namespace etalon {

namespace {

/** Derivative of the residual's gradient by an error that acts as b_a: w J^T J_ba. */
Eigen::MatrixXd gradientByError(const LinearizedResidual& residual, Eigen::Index accel_column,
                                Eigen::Index columns) {
  Eigen::MatrixXd by_error = Eigen::MatrixXd::Zero(columns, 3);
  Eigen::MatrixXd J_error;
  for (const LinearizedResidual::Part& part : residual.parts)
    if (part.column <= accel_column && accel_column < part.column + part.J.cols())
      J_error = part.J.middleCols<3>(accel_column - part.column);
  for (const LinearizedResidual::Part& part : residual.parts)
    by_error.middleRows(part.column, part.J.cols()) +=
        residual.weight * part.J.transpose() * J_error;
  return by_error;
}

}  // namespace

void addSlowError(const std::vector<LinearizedResidual>& residuals,
                  const std::vector<Preintegration>& preintegrations, const SlowAcceleration& slow,
                  Eigen::Index accel_column, Eigen::MatrixXd* score) {
  if (!(slow.sigma_mps2 > 0.0)) return;
  std::vector<Eigen::MatrixXd> by_error;
  for (const LinearizedResidual& residual : residuals) {
    if (residual.kind != ResidualKind::kImu) continue;
    by_error.push_back(gradientByError(residual, accel_column, score->rows()));
  }
  const auto middle = [&](size_t k) {
    return secondsBetween(preintegrations.front().start(), preintegrations[k].start()) +
           0.5 * preintegrations[k].dt();
  };
  const double variance = slow.sigma_mps2 * slow.sigma_mps2;
  for (size_t k = 0; k < by_error.size(); ++k) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(score->rows(), 3);
    for (size_t l = 0; l < by_error.size(); ++l)
      sum += variance * slow.correlation(middle(k) - middle(l)) * by_error[l];
    *score += by_error[k] * sum.transpose();
  }
}

}  // namespace etalon
