#include <cstdio>
#include <memory>
#include <utility>

#include "commands.h"
#include "etalon/evaluation/comparison_table.h"
#include "etalon/evaluation/run_log.h"

namespace etalon::app {

namespace {

struct Arguments {
  std::vector<std::string> runs;
  std::string format = "text";
};

void compare(const Arguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  std::vector<std::pair<std::string, RunRecord>> runs;
  for (const std::string& run : arguments.runs) runs.emplace_back(run, readRunRecord(run));
  std::fputs(compareRuns(runs).toString(format).c_str(), stdout);
  const bool for_people = format == TableFormat::kText || format == TableFormat::kMarkdown;
  const std::vector<std::string> refusals = refusalsOf(runs);
  if (for_people && !refusals.empty()) {
    std::printf("\n");
    for (const std::string& sentence : refusals) std::printf("%s\n", sentence.c_str());
  }
}

}  // namespace

void addCompareCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "compare", "Print a table of runs: errors before and after VI-BA, times, refusals.");
  command->add_option("RUN", arguments->runs, "Folder of a run, or its run.rawlog")->required();
  command->add_option("--format", arguments->format, "How to print the table")
      ->check(CLI::IsMember({"text", "markdown", "csv", "json"}))
      ->capture_default_str();
  command->callback([arguments, exit_code] {
    compare(*arguments);
    *exit_code = kOk;
  });
}

}  // namespace etalon::app
