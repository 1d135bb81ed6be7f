#include "bundle/linearized_residual.h"

namespace etalon {

Eigen::MatrixXd timesCovariance(const LinearizedResidual& a, const Eigen::MatrixXd& P) {
  Eigen::MatrixXd JP = Eigen::MatrixXd::Zero(a.r.size(), P.cols());
  for (const LinearizedResidual::Part& part : a.parts)
    JP.noalias() += part.J * P.middleRows(part.column, part.J.cols());
  return JP;
}

Eigen::MatrixXd timesTransposed(const Eigen::MatrixXd& JP, const LinearizedResidual& b) {
  Eigen::MatrixXd JPJ = Eigen::MatrixXd::Zero(JP.rows(), b.r.size());
  for (const LinearizedResidual::Part& part : b.parts)
    JPJ.noalias() += JP.middleCols(part.column, part.J.cols()) * part.J.transpose();
  return JPJ;
}

void addInformation(const std::vector<LinearizedResidual>& residuals, NormalEquations* equations) {
  for (const LinearizedResidual& residual : residuals)
    for (const LinearizedResidual::Part& a : residual.parts)
      for (const LinearizedResidual::Part& b : residual.parts)
        equations->add(a.column, b.column, residual.weight * a.J.transpose() * b.J);
}

}  // namespace etalon
