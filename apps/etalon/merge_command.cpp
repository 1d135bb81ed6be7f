#include <algorithm>
#include <cstdio>
#include <memory>

#include "commands.h"
#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/trial/trial.h"
#include "etalon/report/report.h"
#include "etalon/report/trial_tables.h"
#include "support/checks.h"
#include "support/print_recording_errors.h"
#include "support/print_tables.h"

namespace etalon::app {

namespace {

struct MergeArguments {
  std::vector<std::string> folders;
  std::string out, format = "text";
  bool overwrite = false, verbose = false;
};

int mergeRuns(const MergeArguments& arguments) {
  const TrialOutcome outcome =
      mergeTrials(arguments.folders, arguments.out, arguments.overwrite, trialReportHtml);
  std::fputs(trialPage(outcome.record, textStyle()).c_str(), stdout);
  for (const std::string& file : outcome.files) std::fprintf(stderr, "  %s\n", file.c_str());
  printShortfalls(outcome.record);
  return kOk;
}

int merge(const MergeArguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  if (std::all_of(arguments.folders.begin(), arguments.folders.end(), isTrialFolder))
    return mergeRuns(arguments);
  const BenchmarkOutcome outcome =
      mergeBenchmarks(arguments.folders, arguments.out, arguments.overwrite, benchmarkReportHtml);
  printBenchmarkTables(outcome.record, format, arguments.verbose);
  const size_t parts = arguments.folders.size();
  std::fprintf(stderr, "\n%zu results of %zu %s\nwritten:\n", outcome.results_found, parts,
               parts == 1 ? "part" : "parts");
  for (const std::string& file : outcome.files) std::fprintf(stderr, "  %s\n", file.c_str());
  printShortfalls(outcome.record);
  const bool lost = printLostWindows(outcome.record);
  if (printRecordingErrors(outcome.record)) return kDataErrorExit;
  return lost ? kPluginDied : kOk;
}

}  // namespace

void addMergeCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<MergeArguments>();
  CLI::App* command = app.add_subcommand(
      "merge",
      "Join the parts of a benchmark or trial that ran as `etalon bench --shard K/N` (or trial). "
      "Refuses parts of other "
      "code, configuration or data, and windows that are missing or there twice.");
  command->add_option("DIR", arguments->folders, "Folders of the parts")->required();
  command->add_option("--out", arguments->out, "Folder for the joined benchmark or trial")
      ->check(checkOutputPath())
      ->required();
  command->add_flag("--overwrite", arguments->overwrite,
                    "Discard what another one left in the folder");
  command->add_option("--format", arguments->format, "How to print the tables")
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command->add_flag(
      "-v,--verbose", arguments->verbose,
      "As text: a table for each figure with a row for each recording, not one table");
  command->footer(
      "Exit codes: 0 done, 2 usage, or parts that do not belong together, 3 a recording could "
      "not be used by any part (the others are done), 4 an initializer crashed, ended the process "
      "or "
      "used up its time in some windows.");
  command->callback([arguments, exit_code] { *exit_code = merge(*arguments); });
}

}  // namespace etalon::app
