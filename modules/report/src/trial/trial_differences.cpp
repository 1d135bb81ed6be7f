#include "trial/trial_differences.h"

#include <cmath>
#include <limits>

#include "etalon/core/text.h"
#include "etalon/report/benchmark_comparison.h"

namespace etalon {
namespace {

/** Causal ATE of the runs of a variant without a fault. */
FiguresByStart atesOf(const TrialRecord& record, const TrialVariant& variant) {
  FiguresByStart ates;
  for (const TrialRun& run : record.results)
    if (run.fault == kNoFault && run.variant == variant && std::isfinite(run.causal.ate_m))
      ates[{run.recording, durationNs(run.from_s)}] = run.causal.ate_m;
  return ates;
}

/** Each of the other variants less the first one. */
std::vector<PairedComparison> differencesOf(const TrialRecord& record) {
  const std::vector<TrialVariant> variants = variantsOf(record);
  const double length_s = record.protocol.seconds > 0.0 ? record.protocol.seconds
                                                        : std::numeric_limits<double>::infinity();
  std::vector<std::string> recordings;
  for (const BenchmarkSequence& sequence : record.sequences) recordings.push_back(sequence.name);
  std::vector<PairedComparison> differences;
  for (size_t i = 1; i < variants.size(); ++i) {
    differences.push_back(compareFigures("ate_m", atesOf(record, variants[i]),
                                         atesOf(record, variants[0]), length_s, recordings));
    differences.back().a = labelOf(variants[i], record);
    differences.back().b = labelOf(variants[0], record);
  }
  return differences;
}

}  // namespace

TitledTable differenceTable(const TrialRecord& record) {
  Table table({{"a", "what flew"},
               {"b", "less that of"},
               {"pairs", "runs", true, 0},
               {"difference_m", "ATE [mm]", true, 2, 1e3},
               {"low_m", "from", true, 2, 1e3, false, "95 % interval"},
               {"high_m", "to", true, 2, 1e3, false, "95 % interval"},
               {"verdict", "verdict"}});
  const std::vector<PairedComparison> differences = differencesOf(record);
  for (const PairedComparison& d : differences) {
    table.addRow();
    table.setText("a", d.a);
    table.setText("b", d.b);
    table.setNumber("pairs", d.interval.pairs);
    table.setNumber("difference_m", d.interval.difference);
    table.setNumber("low_m", d.interval.low);
    table.setNumber("high_m", d.interval.high);
    table.setText("verdict", d.verdict());
  }
  const std::string note =
      "Median of the differences over pairs of runs. Interval: paired bootstrap of recordings and "
      "their runs, those that overlap being drawn together.";
  return {"differences", "Differences of the causal ATE, without a fault",
          note + sentenceOnRecordings(differences), table};
}

}  // namespace etalon
