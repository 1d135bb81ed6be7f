#include "chain.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

namespace etalon::ground_truth {

ChainEquations::ChainEquations(size_t nodes)
    : diagonal(nodes, NodeMatrix::Zero()),
      next(nodes > 0 ? nodes - 1 : 0, NodeMatrix::Zero()),
      border(nodes, NodeBorder::Zero()),
      rhs(nodes, NodeVector::Zero()) {}

bool ChainSolver::factorize(ChainEquations equations) {
  const size_t n = equations.diagonal.size();
  towards_next_.assign(n, NodeMatrix::Zero());
  conditional_.resize(n);
  towards_border_.resize(n);
  constant_.resize(n);
  log_determinant_ = 0.0;
  for (size_t k = 0; k < n; ++k) {
    const Eigen::LLT<NodeMatrix> cholesky(equations.diagonal[k]);
    if (cholesky.info() != Eigen::Success) return false;
    log_determinant_ += 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
    conditional_[k] = cholesky.solve(NodeMatrix::Identity());
    towards_border_[k].noalias() = -conditional_[k] * equations.border[k];
    constant_[k].noalias() = conditional_[k] * equations.rhs[k];
    // What is left of the equations once node k is eliminated.
    equations.border_diagonal.noalias() += equations.border[k].transpose() * towards_border_[k];
    equations.border_rhs.noalias() -= equations.border[k].transpose() * constant_[k];
    if (k + 1 == n) break;
    const NodeMatrix& next = equations.next[k];
    towards_next_[k].noalias() = -conditional_[k] * next;
    equations.diagonal[k + 1].noalias() += next.transpose() * towards_next_[k];
    equations.border[k + 1].noalias() += next.transpose() * towards_border_[k];
    equations.rhs[k + 1].noalias() -= next.transpose() * constant_[k];
  }
  const Eigen::LLT<BorderMatrix> cholesky(equations.border_diagonal);
  if (cholesky.info() != Eigen::Success) return false;
  log_determinant_ += 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
  border_ = cholesky.solve(equations.border_rhs);
  border_covariance_ = cholesky.solve(BorderMatrix::Identity());
  substituteBack();
  return std::isfinite(log_determinant_) && border_.allFinite();
}

void ChainSolver::substituteBack() {
  nodes_.resize(constant_.size());
  for (size_t k = constant_.size(); k-- > 0;) {
    nodes_[k] = constant_[k] + towards_border_[k] * border_;
    if (k + 1 < constant_.size()) nodes_[k].noalias() += towards_next_[k] * nodes_[k + 1];
  }
}

ChainCovariance ChainSolver::covariance() const {
  const size_t n = constant_.size();
  ChainCovariance P;
  P.diagonal.resize(n);
  P.border.resize(n);
  P.next.resize(n > 0 ? n - 1 : 0);
  P.border_diagonal = border_covariance_;
  for (size_t k = n; k-- > 0;) {
    P.border[k].noalias() = towards_border_[k] * border_covariance_;
    P.diagonal[k] = conditional_[k];
    if (k + 1 < n) {
      P.border[k].noalias() += towards_next_[k] * P.border[k + 1];
      P.next[k].noalias() = towards_next_[k] * P.diagonal[k + 1];
      P.next[k].noalias() += towards_border_[k] * P.border[k + 1].transpose();
      P.diagonal[k].noalias() += P.next[k] * towards_next_[k].transpose();
    }
    P.diagonal[k].noalias() += P.border[k] * towards_border_[k].transpose();
    P.diagonal[k] = (0.5 * (P.diagonal[k] + P.diagonal[k].transpose())).eval();
  }
  return P;
}

}  // namespace etalon::ground_truth
