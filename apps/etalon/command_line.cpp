#include "command_line.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <iostream>

#include "commands.h"
#include "etalon/core/parameters.h"
#include "support/guarded.h"

namespace etalon::app {

namespace {

/** " (did you mean '--initializer'?)" for the first option that the command does not have; else
 * empty. */
std::string nearestOption(const CLI::App& command, const std::vector<std::string>& arguments) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (const std::string& argument : arguments) {
    const std::string word = argument.substr(0, argument.find('='));
    if (word.size() < 3 || word.compare(0, 2, "--") != 0 ||
        std::find(known.begin(), known.end(), word) != known.end())
      continue;
    const std::string nearest = etalon::nearestWord(word, known);
    return nearest.empty() ? "" : " (did you mean '" + nearest + "'?)";
  }
  return "";
}

/** Says what was expected of a command line that was not understood. Returns the exit code. */
int reportUsage(const CLI::App& app, const CLI::ParseError& error,
                const std::vector<std::string>& arguments) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(command->get_name());
  }
  if (arguments.empty()) {
    std::cerr << app.help();
    return kUsageError;
  }
  const std::string& first = arguments.front();
  const bool is_command = std::find(commands.begin(), commands.end(), first) != commands.end();
  if (is_command || first[0] == '-') {
    std::string nearest;
    if (is_command && dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)
      nearest = nearestOption(*app.get_subcommand(first), arguments);
    std::cerr << "etalon: " << error.what() << nearest << "\n"
              << "Run `etalon " << (is_command ? first + " " : "")
              << "--help` for what it takes.\n";
    return kUsageError;
  }
  const std::string nearest = etalon::nearestWord(first, commands);
  std::cerr << "etalon: there is no command '" << first << "'"
            << (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)") << "; expected one of";
  for (const std::string& command : commands) std::cerr << " " << command;
  std::cerr << "\n";
  return kUsageError;
}

/** Parses the command line and runs its command. Returns the exit code. */
int run(const std::vector<std::string>& arguments) {
  CLI::App app{
      "Etalon: stereo-inertial odometry whose initializer is a plugin chosen in an INI file."};
  app.name("etalon");
  app.set_version_flag("--version", ETALON_VERSION, "Print the version and exit.");
  app.set_help_flag("-h,--help", "Print this help and exit.");
  // These exit codes hold for every command whose help lists no others.
  app.footer("Exit codes: 0 done, 2 usage or configuration, 3 data.");
  app.require_subcommand(1);
  int exit_code = kOk;
  addInfoCommand(app, &exit_code);
  addConvertCommand(app, &exit_code);
  addReplayCommand(app, &exit_code);
  addSimulateCommand(app, &exit_code);
  addCompareCommand(app, &exit_code);
  addEvaluateCommand(app, &exit_code);
  addGroundTruthCommand(app, &exit_code);
  addBenchCommand(app, &exit_code);
  addTrialCommand(app, &exit_code);
  addMergeCommand(app, &exit_code);
  addCalibrateDeviceCommand(app, &exit_code);
  addPluginsCommand(app, &exit_code);
  addCheckPluginCommand(app, &exit_code);
  app.footer(
      "Exit codes: 0 done, 2 usage or configuration, 3 data. Where a command has others, its "
      "--help "
      "says so.");
  try {
    // CLI11 takes the words in reverse.
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ParseError& e) {
    return reportUsage(app, e, arguments);
  }
  return exit_code;
}

}  // namespace

int runCommandLine(const std::vector<std::string>& arguments) {
  sayWantOfMemory();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that becomes too long is then an ordinary write error
  return withOutputWritten(guarded([&] { return run(arguments); }));
}

}  // namespace etalon::app
