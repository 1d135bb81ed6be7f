#include <filesystem>

#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/core/folder_lock.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"
#include "suite/merger.h"
#include "suite/suite_files.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

std::string differenceOfProtocols(const BenchmarkProtocol& a, const BenchmarkProtocol& b) {
  if (a.every_s != b.every_s)
    return "windows every " + std::to_string(a.every_s) + " s and every " +
           std::to_string(b.every_s) + " s";
  if (a.keyframes != b.keyframes || a.rates_hz != b.rates_hz || a.min_keyframes != b.min_keyframes)
    return "other windows (keyframes, rates)";
  if (a.vi_ba != b.vi_ba) return "one is with VI-BA, the other without";
  if (a.min_coverage != b.min_coverage)
    return format("--min-coverage %g and %g", a.min_coverage, b.min_coverage);
  return "";
}

}  // namespace

std::string differenceOf(const BenchmarkRecord& a, const BenchmarkRecord& b) {
  return differenceOfSuites(a, b, differenceOfProtocols(a.protocol, b.protocol));
}

BenchmarkOutcome mergeBenchmarks(const std::vector<std::string>& folders, const std::string& out,
                                 bool overwrite, const BenchmarkReport& report) {
  std::vector<std::string> empty;
  for (const std::string& folder : folders)
    if (!isBenchmarkFolder(folder)) empty.push_back("'" + folder + "'");
  if (!empty.empty())
    throw ConfigError("merge: there is no benchmark (benchmark.json) in " + joined(empty));
  if (isBenchmarkFolder(out) && !overwrite)
    throw ConfigError("merge: '" + out +
                      "' holds a benchmark already; choose another --out, or --overwrite it");
  Merger<BenchmarkRecord> merger("benchmark", "window");
  for (const std::string& folder : folders)
    merger.add(folder, readBenchmark(folder), hasBenchmarkResults(folder));
  BenchmarkOutcome outcome;
  outcome.record = merger.finish();
  makeFolder(out);
  const FolderLock lock(out);
  OutputFiles output(out);
  const std::string folder = output.path("");
  writeBenchmarkHead(folder, outcome.record);
  ResultStore store(folder);
  for (const WindowResult& result : outcome.record.results) store.append(result);
  outcome.results_found = outcome.record.results.size();
  requireCoverage(&outcome.record);
  for (const std::string& file : writeBenchmarkResults(folder, outcome.record, report))
    outcome.files.push_back((fs::path(out) / fs::path(file).filename()).string());
  discardBenchmark(out);
  output.putInPlace();
  return outcome;
}

}  // namespace etalon
