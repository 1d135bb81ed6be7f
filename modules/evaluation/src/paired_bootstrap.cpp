#include "etalon/evaluation/paired_bootstrap.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/evaluation/metrics.h"

namespace etalon {
namespace {

/** Median without sorting everything. @param values not empty; reordered */
double medianInPlace(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  if (values->size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values->begin(), middle));
}

double statisticOf(std::vector<double>* values, PairedStatistic statistic) {
  if (statistic == PairedStatistic::kMedian) return medianInPlace(values);
  return std::accumulate(values->begin(), values->end(), 0.0) / static_cast<double>(values->size());
}

void check(const std::vector<double>& a, const std::vector<double>& b,
           const BootstrapOptions& options) {
  if (a.size() != b.size())
    throw ConfigError("paired bootstrap: expected as many values on both sides, got " +
                      std::to_string(a.size()) + " and " + std::to_string(b.size()));
  for (const std::vector<double>* values : {&a, &b})
    if (!std::all_of(values->begin(), values->end(), [](double v) { return std::isfinite(v); }))
      throw ConfigError("paired bootstrap: expected finite values");
  if (options.resamples < 1 || !(options.confidence > 0.0 && options.confidence < 1.0))
    throw ConfigError(
        "paired bootstrap: expected at least one resample and a confidence between 0 and 1");
}

}  // namespace

BootstrapInterval pairedBootstrap(const std::vector<double>& a, const std::vector<double>& b,
                                  PairedStatistic statistic, const BootstrapOptions& options) {
  check(a, b, options);
  BootstrapInterval interval;
  interval.pairs = static_cast<int>(a.size());
  if (a.empty()) return interval;

  std::vector<double> differences(a.size()), drawn(a.size());
  for (size_t i = 0; i < a.size(); ++i) differences[i] = a[i] - b[i];
  drawn = differences;
  interval.difference = statisticOf(&drawn, statistic);

  std::mt19937_64 generator(options.seed);
  std::vector<double> resampled;
  for (int r = 0; r < options.resamples; ++r) {
    for (double& value : drawn) value = differences[generator() % differences.size()];
    resampled.push_back(statisticOf(&drawn, statistic));
  }
  const double tail = 0.5 * (1.0 - options.confidence);
  interval.low = quantileOf(resampled, tail);
  interval.high = quantileOf(std::move(resampled), 1.0 - tail);
  return interval;
}

}  // namespace etalon
