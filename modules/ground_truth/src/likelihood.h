#pragma once

#include <vector>

#include "chain.h"
#include "error_sizes.h"
#include "flight_model.h"

namespace etalon::ground_truth {

/** What the linearised flight says at given sizes of its errors. */
struct Posterior {
  double objective = 0.0;  ///< minus the logarithm of the marginal likelihood and the priors
  std::vector<NodeVector> nodes;
  BorderVector border;
  BorderMatrix border_covariance;
};

/** Gradient of Posterior::objective by the logarithms of the sizes. */
struct Slope {
  SizeVector total = SizeVector::Zero();
  std::vector<SizeVector> of_blocks;  ///< the same without the priors, by block of nodes
};

/** The marginal likelihood of the sizes: Gaussian, since the flight is linearised. */
class Likelihood {
 public:
  /** @param linear must outlive this */
  Likelihood(const Linearisation& linear, const SizePriors& priors)
      : linear_(linear), priors_(priors) {}

  const SizePriors& priors() const { return priors_; }
  size_t size() const { return linear_.nodes.size(); }  ///< nodes
  size_t believedRows() const;

  /**
   * @param left_out nodes whose rows do not count: [first, second)
   * @return false if the equations are not positive definite
   */
  bool solve(const SizeVector& log_sizes, Posterior* posterior,
             std::pair<size_t, size_t> left_out = {0, 0});

  /** After solve() with nothing left out: by Fisher's identity, from the covariances of all terms.
   * @param block_begins first nodes of the blocks; empty for none */
  Slope slope(const std::vector<size_t>& block_begins = {}) const;

 private:
  /** A motion term whitened: [J_this, J_next, J_gravity, residual]. */
  struct WhiteMotion {
    Eigen::Matrix<double, 15, 15> L;  ///< Cholesky factor of its covariance
    Eigen::Matrix<double, 15, 34> rows;
  };
  /** A correlated error and its rate from a node to the next, an axis: x_next = F x + noise. */
  struct Decay {
    Eigen::Matrix2d F, covariance, information;
  };

  double sizeOf(int index) const { return std::exp(log_sizes_[index]); }
  Decay decay(int kind, double dt) const;
  void addRow(size_t k, ChainEquations* equations) const;
  void addMotion(size_t k, ChainEquations* equations);
  void addDecay(size_t k, ChainEquations* equations) const;
  void addStart(size_t k, ChainEquations* equations) const;
  void addShared(ChainEquations* equations) const;
  double halfSquares() const;
  double logNormalisation() const;
  double motionHalfSquares(size_t k) const;
  double rowHalfSquares(size_t k) const;
  double decayHalfSquares(size_t k) const;
  double startHalfSquares(size_t k) const;
  double sharedHalfSquares() const;
  bool counts(size_t k) const {
    return linear_.nodes[k].counts && (k < left_out_.first || k >= left_out_.second);
  }
  bool starts(size_t k) const { return k == 0 || !linear_.motions[k - 1].known; }
  /** A correlated error and its rate after the step, 3 x 2. */
  Eigen::Matrix<double, 3, 2> errorAfter(size_t k, int kind) const;

  void rowSlope(size_t k, const ChainCovariance& P, SizeVector* slope) const;
  void bandwidthSlope(const ChainCovariance& P, const std::vector<size_t>& block_begins,
                      Slope* slope) const;
  void motionSlope(size_t k, const ChainCovariance& P, SizeVector* slope) const;
  void decaySlope(size_t k, const ChainCovariance& P, SizeVector* slope) const;

  const Linearisation& linear_;
  SizePriors priors_;
  SizeVector log_sizes_;
  std::pair<size_t, size_t> left_out_;
  std::vector<RowTerm> rows_;
  std::vector<WhiteMotion> white_;
  ChainSolver solver_;
};

}  // namespace etalon::ground_truth
