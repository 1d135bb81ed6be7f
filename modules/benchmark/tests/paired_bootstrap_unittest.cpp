#include "etalon/benchmark/paired_bootstrap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

/** Pairs whose differences are normal; what both share is much larger. */
struct NormalPairs {
  std::vector<double> a, b;

  NormalPairs(int count, double mean, double sigma, unsigned seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < count; ++i) {
      const double shared = 100.0 * normal(generator);
      b.push_back(shared);
      a.push_back(shared + mean + sigma * normal(generator));
    }
  }
};

/** The bootstrap of one recording, with every pair drawn by itself. */
BootstrapInterval pairedBootstrap(const std::vector<double>& a, const std::vector<double>& b,
                                  PairedStatistic statistic, const BootstrapOptions& options = {}) {
  return etalon::pairedBootstrap({{a, b}}, statistic, options);
}

TEST(PairedBootstrap, IdenticalSamplesGiveZeroAndNothingElse) {
  const NormalPairs pairs(50, 0.0, 1.0, 1);
  for (const PairedStatistic statistic : {PairedStatistic::kMedian, PairedStatistic::kMean}) {
    const BootstrapInterval interval = pairedBootstrap(pairs.a, pairs.a, statistic);
    EXPECT_EQ(interval.pairs, 50);
    EXPECT_EQ(interval.difference, 0.0);
    EXPECT_EQ(interval.low, 0.0);
    EXPECT_EQ(interval.high, 0.0);
    EXPECT_FALSE(interval.significant());
  }
}

TEST(PairedBootstrap, FindsAKnownNormalDifference) {
  const int n = 400;
  const NormalPairs pairs(n, 0.5, 1.0, 2);
  // Standard errors: 1 / sqrt(n) of the mean, sqrt(pi / 2) times that of the median.
  for (const auto& [statistic, error] :
       {std::pair<PairedStatistic, double>{PairedStatistic::kMean, 1.0 / std::sqrt(n)},
        {PairedStatistic::kMedian, std::sqrt(M_PI / 2 / n)}}) {
    const BootstrapInterval interval = pairedBootstrap(pairs.a, pairs.b, statistic);
    EXPECT_NEAR(interval.difference, 0.5, 3 * error);
    EXPECT_TRUE(interval.significant());
    // The width is 2 * 1.96 standard errors; it varies by some 5 % for the mean, and by 20 % for
    // the median, whose bootstrap rests on the spacing of a few values.
    EXPECT_NEAR(interval.high - interval.low, 3.92 * error, 0.35 * 3.92 * error);
    EXPECT_LT(interval.low, interval.difference);
    EXPECT_GT(interval.high, interval.difference);
  }
}

TEST(PairedBootstrap, CoversTheTruthAsOftenAsItSays) {
  BootstrapOptions options;
  options.resamples = 400;
  const int trials = 400;
  for (const PairedStatistic statistic : {PairedStatistic::kMean, PairedStatistic::kMedian}) {
    int covered = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const NormalPairs pairs(60, 0.3, 1.0, 1000u + static_cast<unsigned>(trial));
      options.seed = static_cast<unsigned>(trial);
      const BootstrapInterval interval = pairedBootstrap(pairs.a, pairs.b, statistic, options);
      if (interval.low <= 0.3 && 0.3 <= interval.high) ++covered;
    }
    // 0.95 +- 0.011 (one sigma of 400 trials); the percentile interval of 60 pairs and 400
    // resamples is known to fall short by 1 to 2 %.
    EXPECT_GT(covered, 0.90 * trials);
    EXPECT_LT(covered, 0.985 * trials);
  }
}

/** How often the interval holds the truth, which is zero, among 200 benchmarks. */
struct Coverage {
  static constexpr int kTrials = 200;
  int covered = 0;

  void add(const std::vector<PairedCluster>& clusters, unsigned seed) {
    BootstrapOptions options;
    options.resamples = 200;
    options.seed = seed;
    const BootstrapInterval interval =
        etalon::pairedBootstrap(clusters, PairedStatistic::kMedian, options);
    covered += interval.low <= 0.0 && 0.0 <= interval.high ? 1 : 0;
  }
  double share() const { return static_cast<double>(covered) / kTrials; }
};

/** The coverage of `count` recordings of 20 windows whose differences vary as much from recording
 * to recording as within one: windows drawn one by one, and recordings drawn as wholes. */
std::pair<double, double> coverageOf(size_t count) {
  Coverage results, recordings;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  for (unsigned trial = 0; trial < Coverage::kTrials; ++trial) {
    PairedCluster pooled;
    std::vector<PairedCluster> clusters(count);
    for (PairedCluster& cluster : clusters) {
      const double of_recording = normal(generator);
      for (int i = 0; i < 20; ++i) {
        cluster.a.push_back(of_recording + normal(generator));
        cluster.b.push_back(0.0);
      }
      pooled.a.insert(pooled.a.end(), cluster.a.begin(), cluster.a.end());
      pooled.b.insert(pooled.b.end(), cluster.b.begin(), cluster.b.end());
    }
    results.add({pooled}, trial);
    recordings.add(clusters, trial);
  }
  std::printf(
      "%zu recordings: a 95 %% interval of windows holds the truth in %.0f %%, of recordings "
      "in %.0f %%\n",
      count, 100.0 * results.share(), 100.0 * recordings.share());
  return {results.share(), recordings.share()};
}

TEST(PairedBootstrap, RecordingsAreDrawnAsWholesForTheirWindowsHaveMuchInCommon) {
  // One sigma of 200 trials is 0.015 at 0.95. Few clusters claim too much: n of them show only
  // (n - 1) / n of their variance, and a percentile interval has no t quantile.
  for (const size_t count : {2u, 3u, 5u, 7u}) {
    const auto [results, recordings] = coverageOf(count);
    EXPECT_LT(results, 0.6) << count;
    EXPECT_GT(recordings, count < 7 ? results + 0.15 : 0.86) << count;
    EXPECT_LT(recordings, 0.985) << count;
  }
}

TEST(PairedBootstrap, OverlappingWindowsAreDrawnInBlocks) {
  // One recording of 100 windows, each of which shares measurements with the four next to it.
  Coverage single, blocks;
  std::mt19937_64 generator(6);
  std::normal_distribution<double> normal;
  for (unsigned trial = 0; trial < Coverage::kTrials; ++trial) {
    std::vector<double> measurements;
    for (int i = 0; i < 104; ++i) measurements.push_back(normal(generator));
    PairedCluster cluster;
    cluster.b.assign(100, 0.0);
    for (size_t i = 0; i < 100; ++i)
      cluster.a.push_back(measurements[i] + measurements[i + 1] + measurements[i + 2] +
                          measurements[i + 3] + measurements[i + 4]);
    single.add({cluster}, trial);
    cluster.block = 5;
    blocks.add({cluster}, trial);
  }
  // The variance of the mean is 5 times that of independent windows; blocks as long as the overlap
  // find 1 + 2 * (0.8 * 0.8 + 0.6 * 0.6 + 0.4 * 0.4 + 0.2 * 0.2) = 3.4 of it (Kuensch 1989: each
  // lag counts by the share of the block that has it): an interval of 0.82 of the width, 0.89.
  EXPECT_LT(single.share(), 0.72);
  EXPECT_GT(blocks.share(), 0.82);
}

TEST(PairedBootstrap, OfSuccessIsTheDifferenceOfTheRates) {
  std::vector<double> a(100, 1.0), b(100, 1.0);
  for (size_t i = 0; i < 30; ++i) b[i] = 0.0;
  for (size_t i = 30; i < 40; ++i) a[i] = 0.0;
  const BootstrapInterval interval = pairedBootstrap(a, b, PairedStatistic::kMean);
  EXPECT_NEAR(interval.difference, 0.2, 1e-15);
  // sigma of the mean of 30 times +1, 10 times -1, 60 times 0: sqrt((0.4 - 0.04) / 100) = 0.06.
  EXPECT_NEAR(interval.low, 0.2 - 1.96 * 0.06, 0.02);
  EXPECT_NEAR(interval.high, 0.2 + 1.96 * 0.06, 0.02);
}

TEST(PairedBootstrap, IsRepeatableAndDependsOnTheSeed) {
  const NormalPairs pairs(40, 0.1, 1.0, 3);
  BootstrapOptions options;
  const BootstrapInterval one = pairedBootstrap(pairs.a, pairs.b, PairedStatistic::kMean, options);
  const BootstrapInterval again =
      pairedBootstrap(pairs.a, pairs.b, PairedStatistic::kMean, options);
  EXPECT_EQ(one.low, again.low);
  EXPECT_EQ(one.high, again.high);
  options.seed = 2;
  const BootstrapInterval other =
      pairedBootstrap(pairs.a, pairs.b, PairedStatistic::kMean, options);
  EXPECT_NE(one.low, other.low);
  EXPECT_EQ(one.difference, other.difference);
}

TEST(PairedBootstrap, OnePairOrNone) {
  const BootstrapInterval one = pairedBootstrap({3.0}, {1.0}, PairedStatistic::kMedian);
  EXPECT_EQ(one.low, 2.0);
  EXPECT_EQ(one.high, 2.0);
  const BootstrapInterval none = pairedBootstrap({}, {}, PairedStatistic::kMedian);
  EXPECT_EQ(none.pairs, 0);
  EXPECT_TRUE(std::isnan(none.low));
  EXPECT_FALSE(none.significant());
}

TEST(PairedBootstrap, RefusesWhatCannotBe) {
  const auto bootstrap = [](const std::vector<double>& a, const std::vector<double>& b,
                            const BootstrapOptions& options = {}) {
    return pairedBootstrap(a, b, PairedStatistic::kMean, options);
  };
  EXPECT_THROW(bootstrap({1.0}, {}), ConfigError);
  EXPECT_THROW(bootstrap({NAN}, {1.0}), ConfigError);
  EXPECT_THROW(bootstrap({1.0}, {1.0}, {0, 0.95, 1}), ConfigError);
  EXPECT_THROW(bootstrap({1.0}, {1.0}, {10, 1.0, 1}), ConfigError);
  EXPECT_THROW(etalon::pairedBootstrap({{{1.0}, {1.0}, 0}}, PairedStatistic::kMean), ConfigError);
}

}  // namespace
}  // namespace etalon
