#pragma once

#include <cstdint>
#include <limits>
#include <vector>

namespace etalon {

struct BootstrapOptions {
  int resamples = 10000;
  double confidence = 0.95;  ///< in (0, 1)
  std::uint64_t seed = 1;
};

/** A difference and its confidence interval. NaN where there is no pair. */
struct BootstrapInterval {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  int pairs = 0;
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
 * Percentile bootstrap over pairs (Efron and Tibshirani, An Introduction to the Bootstrap, 1993,
 * chapter 13): pairs are drawn with replacement, as many as there are; the interval is between the
 * quantiles (see quantileOf()) at (1 - confidence) / 2 and its complement of the statistic over all
 * resamples. Draws are mt19937_64(seed) modulo the number of pairs, one after the other: the same
 * on every platform.
 * @param a,b values of the same thing for both, pair by pair
 * @throws ConfigError if the sizes differ, a value is not finite or an option cannot be
 */
BootstrapInterval pairedBootstrap(const std::vector<double>& a, const std::vector<double>& b,
                                  PairedStatistic statistic, const BootstrapOptions& options = {});

}  // namespace etalon
