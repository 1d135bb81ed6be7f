#include "etalon/report/benchmark_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>

#include "benchmark_side_tables.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

/** A figure of one initializer in the windows of a shape. */
FiguresByStart figuresOf(const BenchmarkRecord& record, const WindowShape& shape,
                         const std::vector<std::optional<bool>>& success,
                         const std::string& initializer, const std::string& stage,
                         const std::string& figure) {
  FiguresByStart figures;
  for (size_t i = 0; i < record.results.size(); ++i) {
    const WindowResult& result = record.results[i];
    if (result.initializer != initializer || result.shape() != shape) continue;
    double value = WindowErrors::kNone;
    if (figure == kSuccessRate) {
      if (success[i]) value = *success[i] ? 1.0 : 0.0;
    } else if (result.attempt.stage(stage)) {
      value = windowRow(result, stage).errors.*windowMetric(figure).error;
    }
    if (std::isfinite(value)) figures[{result.sequence, result.t0}] = value;
  }
  return figures;
}

/** The pairs of one recording, in the order of time. */
struct Pairs {
  PairedCluster values;
  std::vector<TimeNs> starts;  ///< of the windows or runs

  /** The largest number of those that begin before the end of one of them, from that one on. */
  size_t overlapping(double length_s) const {
    constexpr double kShare = 0.99;  // of the length; two that meet in a keyframe are apart
    size_t most = 1, last = 0;
    for (size_t first = 0; first < starts.size(); ++first) {
      while (last < starts.size() &&
             secondsBetween(starts[first], starts[last]) < kShare * length_s)
        ++last;
      most = std::max(most, last - first);
    }
    return most;
  }
};

double differenceOf(const PairedCluster& cluster, bool rate) {
  std::vector<double> differences;
  for (size_t i = 0; i < cluster.a.size(); ++i) differences.push_back(cluster.a[i] - cluster.b[i]);
  const FigureSummary summary = summaryOf(differences);
  return rate ? summary.mean : summary.median;
}

/** Recordings of the same name must be the same. */
void checkContent(const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks) {
  std::map<std::string, std::pair<std::string, std::string>>
      first;  // content and benchmark by name
  for (const auto& [name, record] : benchmarks)
    for (const BenchmarkSequence& sequence : record.sequences) {
      if (sequence.content.empty()) continue;
      const auto [known, is_new] = first.emplace(sequence.name, std::pair(sequence.content, name));
      if (!is_new && known->second.first != sequence.content)
        throw ConfigError("sequence '" + sequence.name + "' of '" + name +
                          "' is another recording than that of '" + known->second.second +
                          "'; expected the same data on both sides");
    }
}

}  // namespace

BenchmarkRecord combineBenchmarks(
    const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks) {
  checkContent(benchmarks);
  std::map<std::string, int> uses;
  for (const auto& [name, record] : benchmarks)
    for (const std::string& initializer : initializersOf(record)) ++uses[initializer];
  BenchmarkRecord all;
  all.protocol.keyframes.clear();  // taken from the windows below
  all.protocol.rates_hz.clear();
  if (benchmarks.size() == 1) all.protocol = benchmarks.front().second.protocol;
  all.protocol.vi_ba = false;
  all.protocol.min_coverage = 0.0;
  std::set<std::string> known;
  for (const auto& [name, record] : benchmarks) {
    const auto fullName = [&, prefix = name + "/"](const std::string& initializer) {
      return uses[initializer] > 1 ? prefix + initializer : initializer;
    };
    all.protocol.vi_ba = all.protocol.vi_ba || record.protocol.vi_ba;
    all.protocol.min_keyframes =
        std::max(all.protocol.min_keyframes, record.protocol.min_keyframes);
    all.protocol.min_coverage = std::max(all.protocol.min_coverage, record.protocol.min_coverage);
    for (const BenchmarkSequence& sequence : record.sequences)
      if (known.insert(sequence.name).second) all.sequences.push_back(sequence);
    for (BenchmarkInitializer initializer : record.initializers) {
      initializer.name = fullName(initializer.name);
      all.initializers.push_back(initializer);
    }
    for (WindowResult result : record.results) {
      result.initializer = fullName(result.initializer);
      all.results.push_back(std::move(result));
    }
  }
  return all;
}

BenchmarkRecord selectInitializers(const BenchmarkRecord& record,
                                   const std::vector<std::string>& names) {
  const std::vector<std::string> there = initializersOf(record);
  BenchmarkRecord selected = record;
  selected.results.clear();
  selected.initializers.clear();
  for (const std::string& name : names) {
    if (std::find(there.begin(), there.end(), name) == there.end())
      throw ConfigError("initializer '" + name + "': expected one of " + joined(there));
    for (const WindowResult& result : record.results)
      if (result.initializer == name) selected.results.push_back(result);
    for (const BenchmarkInitializer& initializer : record.initializers)
      if (initializer.name == name) selected.initializers.push_back(initializer);
  }
  return selected;
}

double PairedComparison::smallestRelevantDifference() const {
  if (figure == kSuccessRate) return std::pow(10.0, -kSuccessDecimals) / 100.0;
  const double share = kRelevantShare * std::min(std::abs(value_a), std::abs(value_b));
  return std::max(share, windowMetric(figure).lastDigit());
}

std::string PairedComparison::verdict() const {
  if (apart < kMinPairs) return "too few pairs";
  if (!interval.significant()) return "no significant difference";
  if (std::abs(interval.difference) < smallestRelevantDifference()) return "no relevant difference";
  const bool a_is_less = interval.high < 0.0;
  return (a_is_less == (figure != kSuccessRate) ? a : b) + " is better" +
         (interval.clusters == 1 ? ", this recording alone" : "");
}

std::vector<std::string> comparedFigures() {
  std::vector<std::string> figures = {kSuccessRate};
  for (const WindowMetric& metric : windowMetrics()) figures.push_back(metric.key);
  return figures;
}

PairedComparison compareFigures(const std::string& figure, const FiguresByStart& a,
                                const FiguresByStart& b, double length_s,
                                const std::vector<std::string>& sequences,
                                const BootstrapOptions& options) {
  const bool rate = figure == kSuccessRate;
  PairedComparison comparison;
  comparison.figure = figure;
  comparison.count_a = static_cast<int>(a.size());
  comparison.count_b = static_cast<int>(b.size());
  std::vector<double> paired_a, paired_b;
  std::map<std::string, Pairs> by_sequence;
  for (const auto& [key, value] : a) {
    const auto other = b.find(key);
    if (other == b.end()) continue;
    Pairs& pairs = by_sequence[key.first];
    pairs.values.a.push_back(value);
    pairs.values.b.push_back(other->second);
    pairs.starts.push_back(key.second);
    paired_a.push_back(value);
    paired_b.push_back(other->second);
  }
  const FigureSummary summary_a = summaryOf(paired_a), summary_b = summaryOf(paired_b);
  comparison.value_a = rate ? summary_a.mean : summary_a.median;
  comparison.value_b = rate ? summary_b.mean : summary_b.median;
  std::vector<PairedCluster> clusters;
  for (const std::string& sequence : sequences) {
    const auto pairs = by_sequence.find(sequence);
    if (pairs == by_sequence.end()) continue;
    clusters.push_back(pairs->second.values);
    clusters.back().block = pairs->second.overlapping(length_s);
    comparison.apart +=
        (clusters.back().a.size() + clusters.back().block - 1) / clusters.back().block;
    comparison.by_recording.push_back({sequence, static_cast<int>(clusters.back().a.size()),
                                       differenceOf(clusters.back(), rate)});
  }
  comparison.interval =
      pairedBootstrap(clusters, rate ? PairedStatistic::kMean : PairedStatistic::kMedian, options);
  return comparison;
}

std::vector<PairedComparison> comparePaired(const BenchmarkRecord& record, const std::string& a,
                                            const std::string& b,
                                            const std::vector<std::string>& figures,
                                            const BootstrapOptions& options) {
  const std::vector<std::string> known = comparedFigures();
  for (const std::string& figure : figures)
    if (std::find(known.begin(), known.end(), figure) == known.end())
      throw ConfigError("metric '" + figure + "': expected one of " + joined(known));
  const std::vector<std::string> sequences = sequencesOf(record);
  std::vector<PairedComparison> comparisons;
  for (const WindowShape& shape : shapesOf(record))
    for (const std::string& stage : stagesOf(record)) {
      const std::vector<std::optional<bool>> success = judgedSuccess(record, stage);
      for (const std::string& figure : figures) {
        PairedComparison comparison =
            compareFigures(figure, figuresOf(record, shape, success, a, stage, figure),
                           figuresOf(record, shape, success, b, stage, figure),
                           (shape.keyframes - 1) / shape.rate_hz, sequences, options);
        comparison.a = a;
        comparison.b = b;
        comparison.keyframes = shape.keyframes;
        comparison.rate_hz = shape.rate_hz;
        comparison.stage = stage;
        comparisons.push_back(std::move(comparison));
      }
    }
  return comparisons;
}

}  // namespace etalon
