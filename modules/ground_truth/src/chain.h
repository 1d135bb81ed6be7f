#pragma once

#include <Eigen/Core>
#include <vector>

namespace etalon::ground_truth {

constexpr int kNodeSize = 27;    ///< unknowns of a node of the chain
constexpr int kBorderSize = 11;  ///< unknowns that all nodes share

using NodeMatrix = Eigen::Matrix<double, kNodeSize, kNodeSize>;
using NodeVector = Eigen::Matrix<double, kNodeSize, 1>;
using NodeBorder = Eigen::Matrix<double, kNodeSize, kBorderSize>;
using BorderMatrix = Eigen::Matrix<double, kBorderSize, kBorderSize>;
using BorderVector = Eigen::Matrix<double, kBorderSize, 1>;

/** Normal equations H x = b of a chain whose neighbours are coupled, with a dense border: what is
 * not stored is the transpose of what is, or zero. */
struct ChainEquations {
  std::vector<NodeMatrix> diagonal;  ///< H_kk
  std::vector<NodeMatrix> next;      ///< H_k,k+1; one fewer
  std::vector<NodeBorder> border;    ///< H_k,g
  std::vector<NodeVector> rhs;       ///< b_k
  BorderMatrix border_diagonal = BorderMatrix::Zero();
  BorderVector border_rhs = BorderVector::Zero();

  explicit ChainEquations(size_t nodes);
};

/** The blocks of H^-1 that the equations' own pattern has. */
struct ChainCovariance {
  std::vector<NodeMatrix> diagonal, next;
  std::vector<NodeBorder> border;
  BorderMatrix border_diagonal;
};

/** Block Cholesky along the chain, the border last. */
class ChainSolver {
 public:
  /** False if H is not positive definite. */
  bool factorize(ChainEquations equations);

  double logDeterminant() const { return log_determinant_; }
  const std::vector<NodeVector>& nodes() const { return nodes_; }  ///< x_k
  const BorderVector& border() const { return border_; }           ///< x_g
  const BorderMatrix& borderCovariance() const { return border_covariance_; }

  /** By the recursion of Takahashi et al. (1973) from the last node to the first. */
  ChainCovariance covariance() const;

 private:
  void substituteBack();

  // Given node k+1 and the border, node k is G_k x_k+1 + F_k x_g + c_k with covariance C_k.
  std::vector<NodeMatrix> towards_next_, conditional_;
  std::vector<NodeBorder> towards_border_;
  std::vector<NodeVector> constant_, nodes_;
  BorderVector border_;
  BorderMatrix border_covariance_;
  double log_determinant_ = 0.0;
};

}  // namespace etalon::ground_truth
