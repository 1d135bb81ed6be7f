#pragma once

// What `etalon compare` compares, by kind. Private to the command.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/benchmark/paired_bootstrap.h"
#include "etalon/report/table.h"

namespace etalon::app {

struct CompareArguments {
  std::vector<std::string> runs, initializers, metrics, recordings;
  std::string format = "text", plot;
  std::optional<std::uint64_t> seed;   ///< without: BootstrapOptions'
  std::optional<double> min_coverage;  ///< without: a benchmark's own, of runs kMinCoverage
  bool bold = false, all = false, verbose = false;
};

inline bool isForPeople(TableFormat format) { return format != TableFormat::kCsv; }

/** Folders of runs. */
void compareRunFolders(const CompareArguments& arguments, TableFormat format);

/** Folders of benchmarks. Returns whether they are complete. */
bool compareBenchmarkFolders(const CompareArguments& arguments, TableFormat format);

/** Trajectories of any system, TUM files, judged as `etalon trial` judges them. */
void compareTrajectories(const CompareArguments& arguments, TableFormat format);

}  // namespace etalon::app
