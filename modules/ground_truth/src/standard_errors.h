#pragma once

#include <vector>

#include "likelihood.h"
#include "size_search.h"

namespace etalon::ground_truth {

/** The shared unknowns and how well they are known. */
struct BorderEstimate {
  BorderVector move;        ///< from the point of linearisation
  BorderMatrix covariance;  ///< variances: the larger of the model's and the jackknife's
};

/** First nodes of the blocks, alike in length: of `block_s` about, five of them at least. */
std::vector<size_t> blocksOf(const std::vector<Node>& nodes, double block_s);

/**
 * Solves at given sizes, and once without each block's rows (delete-a-group jackknife).
 * @param from_sizes what the uncertainty of the sizes adds to the covariance
 */
BorderEstimate estimateBorder(Likelihood* likelihood, const SizeVector& log_sizes,
                              const std::vector<size_t>& block_begins,
                              const BorderMatrix& from_sizes);

}  // namespace etalon::ground_truth
