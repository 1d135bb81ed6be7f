#include <algorithm>
#include <cstdio>
#include <memory>

#include "commands.h"
#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/trial/trial.h"
#include "etalon/core/errors.h"
#include "etalon/report/report.h"
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

/** Says what was joined and what it lacks. Returns the exit code. */
template <typename Record>
int tellMerged(const Record& record, const std::vector<std::string>& files, size_t parts) {
  std::fprintf(stderr, "\n%zu results of %zu %s\nwritten:\n", record.results.size(), parts,
               parts == 1 ? "part" : "parts");
  for (const std::string& file : files) std::fprintf(stderr, "  %s\n", file.c_str());
  printShortfalls(record);
  const bool lost = printLost(record);
  if (printRecordingErrors(record)) return kDataErrorExit;
  return lost ? kPluginDied : kOk;
}

int merge(const MergeArguments& arguments) try {
  const auto& [folders, out, format_name, overwrite, verbose] = arguments;
  const TableFormat format = tableFormatFromName(format_name);
  if (std::all_of(folders.begin(), folders.end(), isTrialFolder)) {
    const TrialOutcome trial = mergeTrials(folders, out, overwrite, trialReportHtml);
    printTrialTables(trial.record, format, verbose);
    return tellMerged(trial.record, trial.files, folders.size());
  }
  const BenchmarkOutcome benchmark = mergeBenchmarks(folders, out, overwrite, benchmarkReportHtml);
  printBenchmarkTables(benchmark.record, format, verbose);
  return tellMerged(benchmark.record, benchmark.files, folders.size());
} catch (const DataError& e) {
  throw Error(e.what());  // 3 says that the parts were joined
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
      "As text: a table for each figure with a row for each recording, not one table; of a trial "
      "all tables");
  command->footer(
      "Exit codes: 0 done, 2 usage, or parts that cannot be read or do not belong together, 3 a "
      "recording could not be used by any part (the others are done), 4 an initializer crashed, "
      "ended the process or used up its time in some windows.");
  command->callback([arguments, exit_code] { *exit_code = merge(*arguments); });
}

}  // namespace etalon::app
