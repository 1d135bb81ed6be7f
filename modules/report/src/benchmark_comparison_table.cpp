#include <algorithm>
#include <cmath>

#include "benchmark_side_tables.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_comparison.h"

namespace etalon {
namespace {

/** A figure in the unit of its title, rounded as in the other tables. */
std::string shownValue(const std::string& figure, double value) {
  if (!std::isfinite(value)) return "-";
  const bool rate = figure == kSuccessRate;
  return format("%.*f", rate ? kSuccessDecimals : windowMetric(figure).decimals,
                value * (rate ? 100.0 : windowMetric(figure).factor));
}

/** The same for a difference, which may be too small for those decimals. */
std::string shownDifference(const std::string& figure, double value) {
  if (!std::isfinite(value)) return "-";
  return format("%.3g", value * (figure == kSuccessRate ? 100.0 : windowMetric(figure).factor));
}

/** Recordings of the comparisons, in the order of the first that has each. */
std::vector<std::string> recordingsOf(const std::vector<PairedComparison>& comparisons) {
  std::vector<std::string> sequences;
  for (const PairedComparison& comparison : comparisons)
    for (const RecordingDifference& part : comparison.by_recording)
      if (std::find(sequences.begin(), sequences.end(), part.sequence) == sequences.end())
        sequences.push_back(part.sequence);
  return sequences;
}

std::string differenceKey(const std::string& sequence) { return "difference_" + sequence; }

/** One table holds several units, so its cells are texts for people and numbers for programs. */
std::vector<Table::Column> columnsFor(const std::vector<PairedComparison>& comparisons,
                                      bool group_in_title) {
  std::vector<Table::Column> columns = {{"a", "A", false, 0, 1.0, group_in_title},
                                        {"b", "B", false, 0, 1.0, group_in_title},
                                        {"keyframes", "keyframes", true, 0, 1.0, group_in_title},
                                        {"rate_hz", "rate [Hz]", true, 0, 1.0, group_in_title},
                                        {"stage", "stage"},
                                        {"figure", "figure", false, 0, 1.0, true},
                                        {"title", "figure", false, 0, 1.0, false, "", true},
                                        {"windows_a", "windows A", true, 0},
                                        {"windows_b", "windows B", true, 0},
                                        {"pairs", "pairs", true, 0},
                                        {"recordings", "recordings", true, 0, 1.0, true}};
  const auto add = [&columns](const std::string& key, const std::string& title,
                              const std::string& group) {
    columns.push_back({key, title, true, 6, 1.0, true});
    columns.push_back({key + "_text", title, false, 0, 1.0, false, group, true});
  };
  for (const auto& [key, title] : {std::pair("value_a", "A"),
                                   {"value_b", "B"},
                                   {"difference", "A - B"},
                                   {"low", "from"},
                                   {"high", "to"}})
    add(key, title, "");
  columns.push_back({"smallest_relevant_difference", "relevant from", true, 6, 1.0, true});
  columns.push_back({"verdict", "verdict"});
  for (const std::string& sequence : recordingsOf(comparisons))
    add(differenceKey(sequence), sequence, "A - B by recording");
  return columns;
}

void addRow(const PairedComparison& c, bool group_in_title, Table* table) {
  const bool rate = c.figure == kSuccessRate;
  table->addRow();
  table->setText("a", c.a);
  table->setText("b", c.b);
  table->setNumber("keyframes", c.keyframes);
  table->setNumber("rate_hz", c.rate_hz);
  table->setText("stage", c.stage);
  table->setText("figure", c.figure);
  table->setText("title", rate ? "success [%]" : windowMetric(c.figure).title);
  table->setNumber("windows_a", c.count_a);
  table->setNumber("windows_b", c.count_b);
  table->setNumber("pairs", c.interval.pairs);
  table->setNumber("recordings", c.interval.clusters);
  for (const auto& [key, value] : {std::pair("value_a", c.value_a), {"value_b", c.value_b}}) {
    table->setNumber(key, value);
    table->setText(std::string(key) + "_text", shownValue(c.figure, value));
  }
  const auto setDifference = [&](const std::string& key, double value) {
    table->setNumber(key, value);
    table->setText(key + "_text", shownDifference(c.figure, value));
  };
  setDifference("difference", c.interval.difference);
  setDifference("low", c.interval.low);
  setDifference("high", c.interval.high);
  for (const RecordingDifference& part : c.by_recording)
    setDifference(differenceKey(part.sequence), part.difference);
  table->setNumber("smallest_relevant_difference", c.smallestRelevantDifference());
  PairedComparison named = c;
  if (group_in_title) {
    named.a = "A";
    named.b = "B";
  }
  table->setText("verdict", named.verdict());
}

}  // namespace

std::string sentenceOnRecordings(const std::vector<PairedComparison>& comparisons) {
  const size_t recordings = recordingsOf(comparisons).size();
  if (recordings == 1)
    return " There is one recording: the intervals hold for this flight alone, whose parts have "
           "its biases and its scene in common.";
  if (recordings > 0 && recordings < static_cast<size_t>(kMinRecordings))
    return " There are " + std::to_string(recordings) +
           " recordings: too few to show how much recordings differ, the intervals are too narrow.";
  return "";
}

TitledTable comparisonTable(const std::vector<PairedComparison>& comparisons,
                            const BootstrapOptions& options, bool group_in_title) {
  Table table(columnsFor(comparisons, group_in_title));
  for (const PairedComparison& comparison : comparisons) addRow(comparison, group_in_title, &table);
  const std::string note = format(
      "On the windows that both have. Errors: medians over the windows where both give a "
      "value, and the median of the differences; success: rates over all windows that can "
      "be judged, refused ones included. Interval: %g %%, paired percentile bootstrap of "
      "recordings and their windows, %d resamples, seed %llu. Not relevant: a difference "
      "below %g %% of the smaller median, or below the last digit of the tables. %zu "
      "comparisons were made, without a correction for their number: where nothing "
      "differs, %.0f %% of them look significant.",
      100.0 * options.confidence, options.resamples, static_cast<unsigned long long>(options.seed),
      100.0 * kRelevantShare, comparisons.size(), 100.0 * (1.0 - options.confidence));
  std::string title = "Paired comparison";
  if (group_in_title && !comparisons.empty()) {
    const PairedComparison& c = comparisons.front();
    title += ", " + shapeText({c.keyframes, c.rate_hz}) + ", A = " + c.a + ", B = " + c.b;
  }
  return {"comparison", title, note + sentenceOnRecordings(comparisons), std::move(table), true};
}

}  // namespace etalon
