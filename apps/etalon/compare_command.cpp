#include <algorithm>
#include <cstdio>
#include <filesystem>
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

/** Folders without their parents, where that tells them apart; else the paths as they are. */
std::vector<std::string> shortNames(const std::vector<std::string>& paths) {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    fs::path folder = fs::path(path).lexically_normal();
    if (folder.filename() == kRunLogName || !folder.has_filename()) folder = folder.parent_path();
    const std::string name = folder.filename().string();
    if (name.empty() || std::count(names.begin(), names.end(), name) > 0) return paths;
    names.push_back(name);
  }
  return names;
}

void compare(const Arguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  const bool for_people = format == TableFormat::kText || format == TableFormat::kMarkdown;
  const std::vector<std::string> names = for_people ? shortNames(arguments.runs) : arguments.runs;
  std::vector<std::pair<std::string, RunRecord>> runs;
  for (size_t i = 0; i < names.size(); ++i)
    runs.emplace_back(names[i], readRunRecord(arguments.runs[i]));
  std::fputs(compareRuns(runs).toString(format).c_str(), stdout);
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
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command->callback([arguments, exit_code] {
    compare(*arguments);
    *exit_code = kOk;
  });
}

}  // namespace etalon::app
