#include "standard_errors.h"

#include <algorithm>
#include <cmath>

namespace etalon::ground_truth {

std::vector<size_t> blocksOf(const std::vector<Node>& nodes, double block_s) {
  const double length_s = secondsBetween(nodes.front().body.t, nodes.back().body.t);
  const size_t blocks = std::max<size_t>(5, static_cast<size_t>(std::lround(length_s / block_s)));
  std::vector<size_t> begins(blocks);
  for (size_t b = 0; b < blocks; ++b) begins[b] = nodes.size() * b / blocks;
  return begins;
}

BorderEstimate estimateBorder(Likelihood* likelihood, const SizeVector& log_sizes,
                              const std::vector<size_t>& block_begins,
                              const BorderMatrix& from_sizes) {
  const size_t nodes = likelihood->size(), blocks = block_begins.size();
  Posterior posterior;
  std::vector<BorderVector> without;
  for (size_t b = 0; b < blocks; ++b) {
    const size_t end = b + 1 < blocks ? block_begins[b + 1] : nodes;
    if (likelihood->solve(log_sizes, &posterior, {block_begins[b], end}))
      without.push_back(posterior.border);
  }
  BorderEstimate estimate;
  likelihood->solve(log_sizes, &posterior);
  estimate.move = posterior.border;
  estimate.covariance = posterior.border_covariance + from_sizes;

  const double n = static_cast<double>(without.size());
  BorderVector mean = BorderVector::Zero(), jackknife = BorderVector::Zero();
  for (const BorderVector& border : without) mean += border / n;
  for (const BorderVector& border : without)
    jackknife += (border - mean).cwiseAbs2() * ((n - 1.0) / n);
  // Scaled, so that the correlations stay the model's.
  const BorderVector factor =
      (jackknife.cwiseQuotient(estimate.covariance.diagonal())).cwiseMax(1.0).cwiseSqrt();
  estimate.covariance = (factor.asDiagonal() * estimate.covariance * factor.asDiagonal()).eval();
  return estimate;
}

}  // namespace etalon::ground_truth
