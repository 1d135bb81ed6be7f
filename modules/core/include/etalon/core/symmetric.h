#pragma once

#include <Eigen/Core>

namespace etalon {

/** Eigenvalues, in increasing order, and the unit eigenvectors in the columns of the same order. */
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/** Of a symmetric n x n matrix, whose lower triangle is read. Compiled once: where a matrix has a
 * fixed size, Eigen's solver takes the compiler seconds at every place. */
SymmetricEigen symmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& symmetric);

/** The same without the vectors. */
Eigen::VectorXd symmetricEigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& symmetric);

/** d^T P^-1 d, the square of the Mahalanobis distance; chi-square distributed with n degrees of
 * freedom if d is an error with the covariance P (n x n, positive definite). */
double squaredMahalanobis(const Eigen::Ref<const Eigen::VectorXd>& d,
                          const Eigen::Ref<const Eigen::MatrixXd>& P);

}  // namespace etalon
