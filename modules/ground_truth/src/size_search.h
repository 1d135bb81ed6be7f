#pragma once

#include "likelihood.h"

namespace etalon::ground_truth {

/** The most probable sizes of the errors. */
struct SizeSearch {
  SizeVector log_sizes;
  int evaluations = 0;
};

/** BFGS on the objective of `likelihood`, from `start`. */
SizeSearch searchSizes(Likelihood* likelihood, const SizeVector& start);

/** What is known of the sizes, and what they do to the shared unknowns. */
struct SizeUncertainty {
  SizeMatrix covariance;  ///< of the logarithms, by the curvature of the objective
  SizeMatrix robust;      ///< the same by how much the blocks of the recording disagree
  Eigen::Matrix<double, kBorderSize, kErrorSizes> border_by_size;
};

/** @param block_begins first nodes of the blocks */
SizeUncertainty sizeUncertainty(Likelihood* likelihood, const SizeVector& log_sizes,
                                const std::vector<size_t>& block_begins);

}  // namespace etalon::ground_truth
