#include "etalon/core/symmetric.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace etalon {

SymmetricEigen symmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd symmetricEigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

double squaredMahalanobis(const Eigen::Ref<const Eigen::VectorXd>& d,
                          const Eigen::Ref<const Eigen::MatrixXd>& P) {
  return d.dot(P.ldlt().solve(d));
}

}  // namespace etalon
