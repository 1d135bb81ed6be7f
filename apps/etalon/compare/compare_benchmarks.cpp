#include <algorithm>
#include <cstdio>
#include <utility>

#include "compare/compare.h"
#include "compare/folder_names.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/report/benchmark_comparison.h"
#include "etalon/report/benchmark_overview.h"
#include "etalon/report/comparison_table.h"
#include "support/print_tables.h"

namespace etalon::app {

namespace {

/** Whether to print a table beside the comparison: all, the headlines, or the chosen figures. */
bool isAskedFor(const TitledTable& table, const std::vector<std::string>& metrics, bool all) {
  if (all) return true;
  if (metrics.empty()) return table.headline;
  return std::find(metrics.begin(), metrics.end(), table.figure) != metrics.end();
}

/** Compares the first initializer with each of the others. */
std::vector<PairedComparison> comparisonsWithTheFirst(const BenchmarkRecord& record,
                                                      const std::vector<std::string>& figures,
                                                      const BootstrapOptions& options) {
  const std::vector<std::string> names = initializersOf(record);
  std::vector<PairedComparison> comparisons;
  for (size_t k = 1; k < names.size(); ++k) {
    const auto pair = comparePaired(record, names[0], names[k], figures, options);
    comparisons.insert(comparisons.end(), pair.begin(), pair.end());
  }
  return comparisons;
}

/** The comparisons of one shape of window. */
std::vector<PairedComparison> ofShape(const std::vector<PairedComparison>& comparisons,
                                      const WindowShape& shape) {
  std::vector<PairedComparison> chosen;
  for (const PairedComparison& c : comparisons)
    if (c.keyframes == shape.keyframes && c.rate_hz == shape.rate_hz) chosen.push_back(c);
  return chosen;
}

/** Prints a text table for each pair of initializers and window: with their names in every row it
 * would be wider than most terminals. The note, which is the same for all, comes last. */
void printComparisons(const std::vector<PairedComparison>& comparisons,
                      const BootstrapOptions& options, const TextStyle& style) {
  auto first = comparisons.begin();
  while (first != comparisons.end()) {
    const auto last = std::find_if(first, comparisons.end(), [&](const PairedComparison& c) {
      return c.b != first->b || c.keyframes != first->keyframes || c.rate_hz != first->rate_hz;
    });
    TitledTable table = comparisonTable({first, last}, options, true);
    table.note.clear();
    std::printf("%s\n", toString(table, TableFormat::kText, style).c_str());
    first = last;
  }
  std::printf("%s\n", comparisonTable(comparisons, options).note.c_str());
}

/** Prints, for each shape of window, one table of all initializers and one of their verdicts. */
void printOneScreen(const BenchmarkRecord& record, const std::vector<PairedComparison>& comparisons,
                    const BootstrapOptions& options, const TextStyle& style) {
  printOverview(record, style);
  if (comparisons.empty()) return;
  for (const WindowShape& shape : shapesOf(record))
    std::printf("%s\n", toString(comparisonOverview(ofShape(comparisons, shape), options),
                                 TableFormat::kText, style)
                            .c_str());
}

/** Says what the benchmarks lack, on stdout above tables for people, else on stderr. Returns
 * whether they lack anything. */
bool printIncompleteness(const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks,
                         TableFormat format) {
  bool any = false;
  for (const auto& [name, record] : benchmarks) {
    for (const std::string& sentence : incompleteness(record)) {
      std::fprintf(isForPeople(format) ? stdout : stderr, "INCOMPLETE: %s: %s\n",
                   printable(name).c_str(), printable(sentence).c_str());
      any = true;
    }
  }
  if (any && isForPeople(format)) std::printf("The tables hold what is there.\n\n");
  return any;
}

}  // namespace

bool compareBenchmarkFolders(const CompareArguments& arguments, TableFormat format) {
  const std::vector<std::string> names = shortNames(arguments.runs);
  std::vector<std::pair<std::string, BenchmarkRecord>> benchmarks;
  for (size_t i = 0; i < names.size(); ++i)
    benchmarks.emplace_back(names[i], readBenchmark(arguments.runs[i]));
  const bool complete = !printIncompleteness(benchmarks, format);
  BenchmarkRecord record = combineBenchmarks(benchmarks);
  if (!arguments.initializers.empty()) record = selectInitializers(record, arguments.initializers);
  if (arguments.min_coverage) record.protocol.min_coverage = *arguments.min_coverage;
  requireCoverage(&record);
  for (const std::string& sentence : describeCoverage(record))
    std::fprintf(stderr, "warning: %s\n", sentence.c_str());
  const bool several = initializersOf(record).size() > 1;
  if (!several && !isForPeople(format))
    throw ConfigError("format '" + arguments.format +
                      "' holds the comparison of initializers, and there is only one; its figures "
                      "are in summary.csv");

  BootstrapOptions options;
  options.seed = arguments.seed.value_or(options.seed);
  const bool one_screen = format == TableFormat::kText && !arguments.verbose && !arguments.all &&
                          arguments.metrics.empty();
  if (one_screen) options.resamples = 2000;  // enough for a verdict; intervals have 10000
  std::vector<std::string> figures = arguments.metrics;
  if (figures.empty()) figures = one_screen ? overviewFigures() : comparedFigures();
  const std::vector<PairedComparison> comparisons =
      comparisonsWithTheFirst(record, figures, options);
  const TextStyle style = textStyle(arguments.bold);
  if (one_screen) {
    printOneScreen(record, comparisons, options, style);
    return complete;
  }
  if (isForPeople(format))
    for (const TitledTable& table : benchmarkTables(record))
      if (isAskedFor(table, arguments.metrics, arguments.all))
        std::printf("%s\n", toString(table, format, style).c_str());
  if (!several) return complete;
  if (format == TableFormat::kText)
    printComparisons(comparisons, options, style);
  else if (isForPeople(format))
    std::fputs(toString(comparisonTable(comparisons, options), format).c_str(), stdout);
  else
    std::fputs(comparisonTable(comparisons, options).table.toString(format).c_str(), stdout);
  return complete;
}

}  // namespace etalon::app
