#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "compare/compare.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/report/benchmark_comparison.h"
#include "etalon/report/benchmark_overview.h"
#include "support/checks.h"
#include "support/print_tables.h"

namespace etalon::app {

namespace {

/** @throws ConfigError for options that were given, and are of no use to what is compared
 * @param options each with whether it was given
 * @param expected what they are for */
void refuse(const std::vector<std::pair<const char*, bool>>& options, const std::string& expected) {
  std::string given;
  for (const auto& [name, is_given] : options)
    if (is_given) given += (given.empty() ? "" : ", ") + std::string(name);
  if (!given.empty()) throw ConfigError("compare: " + given + ": expected " + expected);
}

int compare(const CompareArguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  const std::vector<std::pair<const char*, bool>> of_benchmarks = {
      {"--initializers", !arguments.initializers.empty()},
      {"--metric", !arguments.metrics.empty()},
      {"--all", arguments.all},
      {"--seed", arguments.seed.has_value()}};
  if (!arguments.recordings.empty()) {
    refuse(of_benchmarks, "folders of benchmarks, without --recording");
    refuse({{"--min-coverage", arguments.min_coverage.has_value()}},
           "folders of runs or benchmarks, without --recording");
    compareTrajectories(arguments, format);
    return kOk;
  }
  const auto benchmarks =
      std::count_if(arguments.runs.begin(), arguments.runs.end(), isBenchmarkFolder);
  if (benchmarks == static_cast<std::ptrdiff_t>(arguments.runs.size())) {
    refuse({{"--save-plot", !arguments.plot.empty()}},
           "folders of runs, or trajectories and their --recording");
    return compareBenchmarkFolders(arguments, format) ? kOk : kIncomplete;
  }
  if (benchmarks > 0)
    throw ConfigError("runs and benchmarks together: expected folders of one kind");
  refuse(of_benchmarks, "folders of benchmarks");
  refuse({{"--bold", arguments.bold}}, "folders of benchmarks, or trajectories");
  compareRunFolders(arguments, format);
  return kOk;
}

}  // namespace

void addCompareCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command = app.add_subcommand(
      "compare",
      "Print a table of runs: errors before and after VI-BA, times, refusals; or the tables of "
      "benchmarks, and which differences between initializers are significant.");
  command
      ->add_option("RUN", arguments->runs,
                   "Folder of a run, or its run.rawlog; or folders of benchmarks; with "
                   "--recording trajectories of any system: TUM files, or folders of them")
      ->required();
  command
      ->add_option("--recording", arguments->recordings,
                   "RUN are trajectories of these recordings: RECORDING.tum or "
                   "RECORDING-FROM-FAULT.tum; repeatable. Of one recording any TUM file, or the "
                   "folder of a run")
      ->allow_extra_args(false);
  command->add_option("--format", arguments->format, "How to print the table")
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command
      ->add_option("--initializers", arguments->initializers,
                   "Benchmarks: these alone, comma between; the first is compared with the others")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--metric", arguments->metrics,
                   "Benchmarks: these figures alone, comma between, e.g. success,rre_deg")
      ->check(CLI::IsMember(comparedFigures()))
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--min-coverage", arguments->min_coverage,
                   "Share of the frames of a run, or of a window's keyframes, that must have "
                   "ground truth; with less, errors are not given (default: a benchmark's own, of "
                   "runs 0.5)")
      ->check(checkShare());
  command->add_flag(
      "-v,--verbose", arguments->verbose,
      "As text: of benchmarks a table for each figure with a row for each recording, and "
      "the differences with their intervals; of runs and trajectories all columns");
  command->add_flag("--all", arguments->all,
                    "Benchmarks: print all tables, as `etalon bench --format markdown` does");
  command
      ->add_option("--save-plot", arguments->plot,
                   "Runs, and trajectories with --recording: draw them into this .png or .svg file")
      ->check(checkOutputPath());
  command->add_option("--seed", arguments->seed, "Benchmarks: of the bootstrap")
      ->check(checkWholeNumber())
      ->default_str(std::to_string(BootstrapOptions().seed));
  command->add_flag("--bold", arguments->bold,
                    "Benchmarks and trajectories, as text: the best of a row in bold, even if this "
                    "is no terminal");
  command->footer(
      glossary() +
      "Exit codes: 0 done, 1 done, but a benchmark is unfinished or lacks recordings (said above "
      "the tables), 2 usage or configuration, 3 data.");
  command->callback([arguments, exit_code] { *exit_code = compare(*arguments); });
}

}  // namespace etalon::app
