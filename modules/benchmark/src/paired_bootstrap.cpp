#include "etalon/benchmark/paired_bootstrap.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"

namespace etalon {
namespace {

double statisticOf(std::vector<double>* values, PairedStatistic statistic) {
  if (statistic == PairedStatistic::kMedian) return quantile(*values, 0.5);
  return std::accumulate(values->begin(), values->end(), 0.0) / static_cast<double>(values->size());
}

void check(const std::vector<PairedCluster>& clusters, const BootstrapOptions& options) {
  for (const PairedCluster& cluster : clusters) {
    if (cluster.a.size() != cluster.b.size())
      throw ConfigError("paired bootstrap: expected as many values on both sides, got " +
                        std::to_string(cluster.a.size()) + " and " +
                        std::to_string(cluster.b.size()));
    for (const std::vector<double>* values : {&cluster.a, &cluster.b})
      if (!std::all_of(values->begin(), values->end(), [](double v) { return std::isfinite(v); }))
        throw ConfigError("paired bootstrap: expected finite values");
    if (cluster.block < 1) throw ConfigError("paired bootstrap: expected blocks of at least 1");
  }
  if (options.resamples < 1 || !(options.confidence > 0.0 && options.confidence < 1.0))
    throw ConfigError(
        "paired bootstrap: expected at least one resample and a confidence between 0 and 1");
}

/** The differences of a cluster, which are drawn from. */
struct Cluster {
  std::vector<double> differences;
  size_t block = 1;
};

/** Draws as many differences as the cluster has, block by block, and appends them. */
void draw(const Cluster& cluster, std::mt19937_64* generator, std::vector<double>* drawn) {
  const size_t n = cluster.differences.size();
  for (size_t count = 0; count < n;) {
    const size_t first = (*generator)() % n;
    for (size_t k = 0; k < cluster.block && count < n; ++k, ++count)
      drawn->push_back(cluster.differences[(first + k) % n]);
  }
}

}  // namespace

BootstrapInterval pairedBootstrap(const std::vector<PairedCluster>& clusters,
                                  PairedStatistic statistic, const BootstrapOptions& options) {
  check(clusters, options);
  std::vector<Cluster> there;
  std::vector<double> drawn;
  for (const PairedCluster& cluster : clusters) {
    if (cluster.a.empty()) continue;
    there.push_back({{}, cluster.block});
    for (size_t i = 0; i < cluster.a.size(); ++i)
      there.back().differences.push_back(cluster.a[i] - cluster.b[i]);
    drawn.insert(drawn.end(), there.back().differences.begin(), there.back().differences.end());
  }
  BootstrapInterval interval;
  interval.pairs = drawn.size();
  interval.clusters = there.size();
  if (drawn.empty()) return interval;
  interval.difference = statisticOf(&drawn, statistic);

  std::mt19937_64 generator(options.seed);
  std::vector<double> resampled;
  for (int r = 0; r < options.resamples; ++r) {
    drawn.clear();
    for (size_t c = 0; c < there.size(); ++c)
      draw(there[generator() % there.size()], &generator, &drawn);
    resampled.push_back(statisticOf(&drawn, statistic));
  }
  const double tail = 0.5 * (1.0 - options.confidence);
  interval.low = quantile(resampled, tail);
  interval.high = quantile(std::move(resampled), 1.0 - tail);
  return interval;
}

}  // namespace etalon
