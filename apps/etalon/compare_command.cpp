#include <algorithm>
#include <cstddef>
#include <memory>

#include "commands.h"
#include "compare/compare.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/report/benchmark_comparison.h"
#include "support/checks.h"
#include "support/print_tables.h"

namespace etalon::app {

namespace {

int compare(const CompareArguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  if (!arguments.recordings.empty()) {
    compareTrajectories(arguments, format);
    return kOk;
  }
  const auto benchmarks =
      std::count_if(arguments.runs.begin(), arguments.runs.end(), isBenchmarkFolder);
  if (benchmarks == static_cast<std::ptrdiff_t>(arguments.runs.size()))
    return compareBenchmarkFolders(arguments, format) ? kOk : kIncomplete;
  if (benchmarks > 0)
    throw ConfigError("runs and benchmarks together: expected folders of one kind");
  if (!arguments.initializers.empty() || !arguments.metrics.empty())
    throw ConfigError("--initializers and --metric: expected folders of benchmarks");
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
      "Benchmarks, as text: a table for each figure with a row for each recording, and "
      "the differences with their intervals");
  command->add_flag("--all", arguments->all,
                    "Benchmarks: print all tables, as `etalon bench --format markdown` does");
  command
      ->add_option("--save-plot", arguments->plot,
                   "Runs, and trajectories with --recording: draw them into this .png or .svg file")
      ->check(checkOutputPath());
  command->add_option("--seed", arguments->seed, "Benchmarks: of the bootstrap")
      ->check(checkWholeNumber())
      ->capture_default_str();
  command->add_flag("--bold", arguments->bold,
                    "Benchmarks, as text: the best of a row in bold, even if this is no terminal");
  command->footer(
      glossary() +
      "Exit codes: 0 done, 1 done, but a benchmark is unfinished or lacks recordings (said above "
      "the tables), 2 usage or configuration, 3 data.");
  command->callback([arguments, exit_code] { *exit_code = compare(*arguments); });
}

}  // namespace etalon::app
