#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace etalon {

struct BootstrapOptions {
  int resamples = 10000;
  double confidence = 0.95;  ///< in (0, 1)
  std::uint64_t seed = 1;
};

/** Pairs of values of one recording, in the order of time. */
struct PairedCluster {
  std::vector<double> a, b;
  size_t block = 1;  ///< neighbouring pairs that are drawn together: those whose windows overlap
};

/** A difference and its confidence interval. NaN where there is no pair. */
struct BootstrapInterval {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  int pairs = 0;
  int clusters = 0;           ///< number of clusters that have a pair
  double difference = kNone;  ///< of the pairs as they are
  double low = kNone, high = kNone;

  /** Whether zero lies outside the interval. */
  bool significant() const { return low > 0.0 || high < 0.0; }
};

enum class PairedStatistic {
  kMedian,  ///< median of the differences a_i - b_i
  kMean,    ///< their mean, which is the difference of the means
};

/**
 * Percentile bootstrap of clusters (Davison and Hinkley, Bootstrap Methods and their Application,
 * 1997, section 3.8): an effect that the pairs of one recording share is drawn once for each
 * recording, not once for each pair. A resample draws clusters with replacement, as many
 * as there are, and for each of them its pairs with replacement, as many as it has, in blocks of
 * neighbours that go on at the beginning where the pairs end (the circular block bootstrap of
 * Politis and Romano, 1992). The interval is between the quantiles (see quantile()) at (1 -
 * confidence) / 2 and its complement of the statistic over all pairs of a resample. Draws are
 * mt19937_64(seed) modulo the number of choices, one after the other: the same on every platform.
 *
 * With one cluster the interval holds for that one alone. With two to five it is too narrow where
 * clusters differ, because so few do not show how much.
 * @throws ConfigError if sizes differ, a block is empty, a value is not finite or an option is out
 *         of range
 */
BootstrapInterval pairedBootstrap(const std::vector<PairedCluster>& clusters,
                                  PairedStatistic statistic, const BootstrapOptions& options = {});

}  // namespace etalon
