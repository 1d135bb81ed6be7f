#pragma once

#include <CLI/CLI.hpp>

namespace etalon::app {

/** Exit codes of every subcommand. */
enum ExitCode : int {
  kOk = 0,              ///< done; for replay: initialized
  kNotInitialized = 1,  ///< replay: never initialized (reasons printed)
  kIncomplete = 1,      ///< compare: of a benchmark that lacks windows or recordings
  kUsageError = 2,      ///< usage or configuration
  kDataErrorExit = 3,   ///< data
  kCannotBeLoaded = 3,  ///< plugins, check-plugin: the plugin named cannot be found or loaded
  kPluginDied = 4,  ///< replay, bench, trial: a run crashed, ended the process or used up its time
  kInterrupted = 130,  ///< Ctrl-C, as shells have it
};

// One file a subcommand, <name>_command.cpp. Each function adds its subcommand to `app`; the
// subcommand's callback leaves its exit code in *exit_code and may throw etalon::Error.
void addInfoCommand(CLI::App& app, int* exit_code);
void addConvertCommand(CLI::App& app, int* exit_code);
void addSimulateCommand(CLI::App& app, int* exit_code);
void addReplayCommand(CLI::App& app, int* exit_code);
void addCompareCommand(CLI::App& app, int* exit_code);
void addEvaluateCommand(CLI::App& app, int* exit_code);
void addGroundTruthCommand(CLI::App& app, int* exit_code);
void addBenchCommand(CLI::App& app, int* exit_code);
void addTrialCommand(CLI::App& app, int* exit_code);
void addMergeCommand(CLI::App& app, int* exit_code);
void addCalibrateDeviceCommand(CLI::App& app, int* exit_code);
void addPluginsCommand(CLI::App& app, int* exit_code);
void addCheckPluginCommand(CLI::App& app, int* exit_code);

}  // namespace etalon::app
