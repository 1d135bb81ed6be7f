#include "etalon/evaluation/benchmark_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "benchmark_side_tables.h"
#include "etalon/core/errors.h"
#include "table_text.h"

namespace etalon {
namespace {

constexpr int kSuccessDecimals = 1;  ///< of a rate in percent, where it is printed

using SlotKey = std::tuple<std::string, int, double, TimeNs>;

/** A figure of one initializer by slot; nothing where it has none. */
using Figures = std::map<SlotKey, double>;

Figures figuresOf(const BenchmarkRecord& record, const std::vector<std::optional<bool>>& success,
                  const std::string& initializer, const std::string& stage,
                  const std::string& figure) {
  Figures figures;
  for (size_t i = 0; i < record.slots.size(); ++i) {
    const SlotRecord& slot = record.slots[i];
    if (slot.initializer != initializer) continue;
    double value = SegmentErrors::kNone;
    if (figure == kSuccessRate) {
      if (success[i]) value = *success[i] ? 1.0 : 0.0;
    } else if (slot.attempt.stage(stage)) {
      value = segmentRow(slot, stage).errors.*segmentMetric(figure).error;
    }
    if (std::isfinite(value))
      figures[{slot.sequence, slot.keyframes, slot.rate_hz, slot.t0}] = value;
  }
  return figures;
}

bool inWindow(const SlotKey& key, const std::pair<int, double>& window) {
  return std::get<1>(key) == window.first && std::get<2>(key) == window.second;
}

PairedComparison compareFigures(const Figures& a, const Figures& b,
                                const std::pair<int, double>& window, bool rate,
                                const BootstrapOptions& options) {
  PairedComparison comparison;
  std::vector<double> paired_a, paired_b;
  for (const auto& [key, value] : a) {
    if (!inWindow(key, window)) continue;
    ++comparison.count_a;
    if (const auto other = b.find(key); other != b.end()) {
      paired_a.push_back(value);
      paired_b.push_back(other->second);
    }
  }
  for (const auto& [key, value] : b)
    if (inWindow(key, window)) ++comparison.count_b;
  const FigureSummary summary_a = summaryOf(paired_a), summary_b = summaryOf(paired_b);
  comparison.value_a = rate ? summary_a.mean : summary_a.median;
  comparison.value_b = rate ? summary_b.mean : summary_b.median;
  comparison.interval = pairedBootstrap(
      paired_a, paired_b, rate ? PairedStatistic::kMean : PairedStatistic::kMedian, options);
  return comparison;
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

/** A figure in the unit of its title, rounded as in the other tables. */
std::string shownValue(const std::string& figure, double value) {
  if (!std::isfinite(value)) return "-";
  const bool rate = figure == kSuccessRate;
  char text[352];
  std::snprintf(text, sizeof text, "%.*f", rate ? kSuccessDecimals : segmentMetric(figure).decimals,
                value * (rate ? 100.0 : segmentMetric(figure).factor));
  return text;
}

/** The same for a difference, which may be too small for those decimals. */
std::string shownDifference(const std::string& figure, double value) {
  if (!std::isfinite(value)) return "-";
  char text[40];
  std::snprintf(text, sizeof text, "%.3g",
                value * (figure == kSuccessRate ? 100.0 : segmentMetric(figure).factor));
  return text;
}

}  // namespace

BenchmarkRecord combineBenchmarks(
    const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks) {
  checkContent(benchmarks);
  std::map<std::string, int> uses;
  for (const auto& [name, record] : benchmarks)
    for (const std::string& initializer : initializersOf(record)) ++uses[initializer];
  BenchmarkRecord all;
  all.protocol.keyframes.clear();  // of several: what the slots have
  all.protocol.rates_hz.clear();
  if (benchmarks.size() == 1) all.protocol = benchmarks.front().second.protocol;
  all.protocol.vi_ba = false;
  std::set<std::string> known;
  for (const auto& [name, record] : benchmarks) {
    const auto fullName = [&, prefix = name + "/"](const std::string& initializer) {
      return uses[initializer] > 1 ? prefix + initializer : initializer;
    };
    all.protocol.vi_ba = all.protocol.vi_ba || record.protocol.vi_ba;
    for (const BenchmarkSequence& sequence : record.sequences)
      if (known.insert(sequence.name).second) all.sequences.push_back(sequence);
    for (BenchmarkInitializer initializer : record.initializers) {
      initializer.name = fullName(initializer.name);
      all.initializers.push_back(initializer);
    }
    for (SlotRecord slot : record.slots) {
      slot.initializer = fullName(slot.initializer);
      all.slots.push_back(std::move(slot));
    }
  }
  return all;
}

BenchmarkRecord selectInitializers(const BenchmarkRecord& record,
                                   const std::vector<std::string>& names) {
  const std::vector<std::string> there = initializersOf(record);
  BenchmarkRecord selected = record;
  selected.slots.clear();
  selected.initializers.clear();
  for (const std::string& name : names) {
    if (std::find(there.begin(), there.end(), name) == there.end())
      throw ConfigError("initializer '" + name + "': expected one of " + joined(there));
    for (const SlotRecord& slot : record.slots)
      if (slot.initializer == name) selected.slots.push_back(slot);
    for (const BenchmarkInitializer& initializer : record.initializers)
      if (initializer.name == name) selected.initializers.push_back(initializer);
  }
  return selected;
}

double PairedComparison::smallestRelevantDifference() const {
  if (figure == kSuccessRate) return std::pow(10.0, -kSuccessDecimals) / 100.0;
  const double share = kRelevantShare * std::min(std::abs(value_a), std::abs(value_b));
  return std::max(share, segmentMetric(figure).lastDigit());
}

std::string PairedComparison::verdict() const {
  if (interval.pairs < kMinPairs) return "too few pairs";
  if (!interval.significant()) return "no significant difference";
  if (std::abs(interval.difference) < smallestRelevantDifference()) return "no relevant difference";
  const bool a_is_less = interval.high < 0.0;
  return (a_is_less == (figure != kSuccessRate) ? a : b) + " is better";
}

std::vector<std::string> comparedFigures() {
  std::vector<std::string> figures = {kSuccessRate};
  for (const SegmentMetric& metric : segmentMetrics()) figures.push_back(metric.key);
  return figures;
}

std::vector<PairedComparison> comparePaired(const BenchmarkRecord& record, const std::string& a,
                                            const std::string& b,
                                            const std::vector<std::string>& figures,
                                            const BootstrapOptions& options) {
  const std::vector<std::string> known = comparedFigures();
  for (const std::string& figure : figures)
    if (std::find(known.begin(), known.end(), figure) == known.end())
      throw ConfigError("metric '" + figure + "': expected one of " + joined(known));
  std::vector<PairedComparison> comparisons;
  for (const std::pair<int, double>& window : windowsOf(record))
    for (const std::string& stage : stagesOf(record)) {
      const std::vector<std::optional<bool>> success = judgedSuccess(record, stage);
      for (const std::string& figure : figures) {
        PairedComparison comparison = compareFigures(figuresOf(record, success, a, stage, figure),
                                                     figuresOf(record, success, b, stage, figure),
                                                     window, figure == kSuccessRate, options);
        comparison.a = a;
        comparison.b = b;
        comparison.keyframes = window.first;
        comparison.rate_hz = window.second;
        comparison.stage = stage;
        comparison.figure = figure;
        comparisons.push_back(std::move(comparison));
      }
    }
  return comparisons;
}

TitledTable comparisonTable(const std::vector<PairedComparison>& comparisons,
                            const BootstrapOptions& options, bool group_in_title) {
  // One table holds figures of several units: for people they are texts, for programs numbers.
  std::vector<Table::Column> columns = {{"a", "A", false, 0, 1.0, group_in_title},
                                        {"b", "B", false, 0, 1.0, group_in_title},
                                        {"keyframes", "keyframes", true, 0, 1.0, group_in_title},
                                        {"rate_hz", "rate [Hz]", true, 0, 1.0, group_in_title},
                                        {"stage", "stage"},
                                        {"figure", "figure", false, 0, 1.0, true},
                                        {"title", "figure", false, 0, 1.0, false, "", true},
                                        {"slots_a", "slots A", true, 0},
                                        {"slots_b", "slots B", true, 0},
                                        {"pairs", "pairs", true, 0}};
  for (const auto& [key, title] : {std::pair("value_a", "A"),
                                   {"value_b", "B"},
                                   {"difference", "A - B"},
                                   {"low", "from"},
                                   {"high", "to"}}) {
    columns.push_back({key, title, true, 6, 1.0, true});
    columns.push_back({std::string(key) + "_text", title, false, 0, 1.0, false, "", true});
  }
  columns.push_back({"smallest_relevant_difference", "relevant from", true, 6, 1.0, true});
  columns.push_back({"verdict", "verdict"});
  Table table(columns);
  for (const PairedComparison& c : comparisons) {
    const bool rate = c.figure == kSuccessRate;
    table.addRow();
    table.setText("a", c.a);
    table.setText("b", c.b);
    table.setNumber("keyframes", c.keyframes);
    table.setNumber("rate_hz", c.rate_hz);
    table.setText("stage", c.stage);
    table.setText("figure", c.figure);
    table.setText("title", rate ? "success [%]" : segmentMetric(c.figure).title);
    table.setNumber("slots_a", c.count_a);
    table.setNumber("slots_b", c.count_b);
    table.setNumber("pairs", c.interval.pairs);
    for (const auto& [key, value] : {std::pair("value_a", c.value_a), {"value_b", c.value_b}}) {
      table.setNumber(key, value);
      table.setText(std::string(key) + "_text", shownValue(c.figure, value));
    }
    for (const auto& [key, value] : {std::pair("difference", c.interval.difference),
                                     {"low", c.interval.low},
                                     {"high", c.interval.high}}) {
      table.setNumber(key, value);
      table.setText(std::string(key) + "_text", shownDifference(c.figure, value));
    }
    table.setNumber("smallest_relevant_difference", c.smallestRelevantDifference());
    PairedComparison named = c;
    if (group_in_title) {
      named.a = "A";
      named.b = "B";
    }
    table.setText("verdict", named.verdict());
  }
  char note[900];
  std::snprintf(note, sizeof note,
                "On the slots that both have. Errors: medians over the slots where both give a "
                "value, and the median of the differences; success: rates over all slots that can "
                "be judged, refused ones included. Interval: %g %%, paired percentile bootstrap, "
                "%d resamples, seed %llu. Not relevant: a difference below %g %% of the smaller "
                "median, or below the last digit of the tables. %zu comparisons were made, without "
                "a correction for their number: where nothing differs, %.0f %% of them look "
                "significant.",
                100.0 * options.confidence, options.resamples,
                static_cast<unsigned long long>(options.seed), 100.0 * kRelevantShare,
                comparisons.size(), 100.0 * (1.0 - options.confidence));
  std::string title = "Paired comparison";
  if (group_in_title && !comparisons.empty()) {
    const PairedComparison& c = comparisons.front();
    title += ", " + windowText({c.keyframes, c.rate_hz}) + ", A = " + c.a + ", B = " + c.b;
  }
  return {"comparison", title, note, std::move(table), true};
}

}  // namespace etalon
