#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/trial/trial.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/report/report.h"
#include "options/configuration_options.h"
#include "options/ground_truth_option.h"
#include "options/recording_option.h"
#include "options/suite_options.h"
#include "support/checks.h"
#include "support/print_recording_errors.h"
#include "support/print_tables.h"
#include "support/progress_line.h"
#include "support/stop_on_signals.h"
#include "support/versions.h"

namespace etalon::app {

namespace {

struct TrialArguments {
  std::vector<std::string> sources, initializers, odometries, settings, systems;
  std::string faults;
  GroundTruthOption ground_truth;
  ConfigurationOptions configuration;
  TrialProtocol protocol;
  SuiteOptions suite{"out/trial", kTrialTimeLimitS};
};

/** Sets what a setting says as section.key=value; `origin` names the setting in messages. */
void setFrom(const std::string& text, const std::string& origin, IniFile* ini) {
  IniFile one;
  try {
    one.setFromArgument(text);
  } catch (const ConfigError&) {
    throw ConfigError(origin + ": '" + text + "': expected section.key=value");
  }
  for (const std::string& section : one.sections())
    for (const auto& [key, value] : one.section(section))
      ini->set(section, key, value.text, origin);
}

/** A setting: an INI file, or NAME:section.key=value;section.key=value. */
TrialSetting readSetting(const TrialArguments& arguments, const std::string& text) {
  TrialSetting setting;
  IniFile ini = arguments.configuration.ini();
  std::string name = text;
  if (std::filesystem::exists(text)) {
    name = std::filesystem::path(text).stem().string();
    ini.add(IniFile::fromFile(text));
  } else if (!text.empty()) {
    const size_t colon = text.find(':');
    if (colon == std::string::npos || colon == 0)
      throw ConfigError("--settings: expected an INI file or NAME:section.key=value, found '" +
                        text + "'");
    name = text.substr(0, colon);
    for (size_t begin = colon + 1; begin < text.size();) {
      const size_t end = std::min(text.find(';', begin), text.size());
      setFrom(text.substr(begin, end - begin), "--settings " + name, &ini);
      begin = end + 1;
    }
  }
  setting.name = name;
  std::vector<std::string> names = arguments.initializers;
  if (names.empty()) {
    const auto& pipeline = ini.section("pipeline");
    const auto chosen = pipeline.find("initializer");
    names = {chosen == pipeline.end() ? PipelineOptions().initializer : chosen->second.text};
  } else if (names.size() == 1 && names.front() == "all") {
    names.clear();
  }
  setting.configuration = loadSuiteConfiguration(ini, arguments.configuration.plugin_path, names);
  return setting;
}

std::vector<TrialSetting> readSettings(const TrialArguments& arguments) {
  std::vector<TrialSetting> settings;
  if (arguments.settings.empty()) settings.push_back(readSetting(arguments, ""));
  for (const std::string& text : arguments.settings)
    settings.push_back(readSetting(arguments, text));
  return settings;
}

/** NAME=FOLDER, or a folder whose name is the system's. */
NamedText readSystem(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals != std::string::npos) return {text.substr(0, equals), text.substr(equals + 1)};
  return {recordingName(text), text};
}

std::string describe(const BenchmarkProgress& p) {
  return format("trial: runs %zu/%zu, %s left", p.done, p.total, clockTime(p.remaining_s).c_str());
}

/** @throws ConfigError for a kind that there is not */
void checkOdometries(const TrialArguments& arguments) {
  for (const std::string& kind : arguments.odometries) {
    IniFile ini = arguments.configuration.ini();
    ini.set("odometry", "kind", kind, "--odometries");
    loadSuiteConfiguration(ini, arguments.configuration.plugin_path,
                           arguments.initializers.empty() || arguments.initializers.front() == "all"
                               ? std::vector<std::string>{PipelineOptions().initializer}
                               : arguments.initializers);
  }
}

int trial(const TrialArguments& arguments) {
  arguments.ground_truth.check(arguments.sources);
  arguments.configuration.requireNotIn(arguments.suite.out);
  const TableFormat format = tableFormatFromName(arguments.suite.format);
  const std::vector<TrialSetting> settings = readSettings(arguments);
  checkOdometries(arguments);
  TrialOptions options;
  options.sources = arguments.sources;
  options.ground_truth = arguments.ground_truth.path;
  options.out = arguments.suite.out;
  options.protocol = arguments.protocol;
  options.odometries = arguments.odometries;
  if (!arguments.faults.empty()) options.faults = readFaultFile(arguments.faults);
  for (const std::string& text : arguments.systems) options.systems.push_back(readSystem(text));
  options.jobs = arguments.suite.jobs;
  options.time_limit_s = arguments.suite.time_limit_s;
  options.overwrite = arguments.suite.overwrite;
  options.versions = versions();
  readShard(arguments.suite.shard, &options.shard, &options.shards);
  ProgressLine line;
  options.progress = [&line](const BenchmarkProgress& p) {
    line.update(p.done == p.total, [&p] { return describe(p); });
  };
  options.warn = [&line](const std::string& sentence) {
    line.interrupt();
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
  };
  options.report = trialReportHtml;
  options.stop = stopOnSignals();
  options.stopping = [&line] {
    line.interrupt();
    std::fprintf(stderr,
                 "trial: interrupted; it stops after the runs in progress (a second Ctrl-C ends it "
                 "at once)\n");
  };
  const TrialOutcome outcome = runTrial(settings, options);
  line.interrupt();
  printRecordingWarnings(outcome.record);
  if (outcome.interrupted) {
    std::fprintf(stderr,
                 "trial: interrupted; %zu runs are on disk, %zu are missing; the same command goes "
                 "on from here\n",
                 outcome.runs_found + outcome.runs_made, outcome.runs_missing);
    return kInterrupted;
  }
  printTrialTables(outcome.record, format, arguments.suite.verbose);
  std::fprintf(stderr, "\n%zu runs (%zu were there already) in %s\nwritten:\n",
               outcome.runs_found + outcome.runs_made, outcome.runs_found,
               clockTime(outcome.wall_s).c_str());
  for (const std::string& file : outcome.files) std::fprintf(stderr, "  %s\n", file.c_str());
  printShortfalls(outcome.record);
  const bool lost = printLost(outcome.record);
  if (printRecordingErrors(outcome.record)) return kDataErrorExit;
  return lost ? kPluginDied : kOk;
}

/** What flies. */
void addVariantOptions(CLI::App* command, TrialArguments* arguments) {
  const auto list = [&](const std::string& name, std::vector<std::string>* values,
                        const std::string& text) {
    return command->add_option(name, *values, text)->delimiter(',')->allow_extra_args(false);
  };
  list("--initializers", &arguments->initializers,
       "Initializer plugins, separated by commas, or all (default: the configuration's)");
  list("--odometries", &arguments->odometries,
       "Values of [odometry] kind, separated by commas (default: the configuration's)");
  command
      ->add_option("--settings", arguments->settings,
                   "INI file to use on top of the configuration, or "
                   "NAME:section.key=value;section.key=value; repeatable, each is a setting to "
                   "compare")
      ->allow_extra_args(false);
  command
      ->add_option("--system", arguments->systems,
                   "NAME=FOLDER: trajectories of another system, TUM files "
                   "RECORDING-FROM-FAULT.tum; repeatable")
      ->allow_extra_args(false);
}

/** Where and how they fly. */
void addProtocolOptions(CLI::App* command, TrialArguments* arguments) {
  TrialProtocol* protocol = &arguments->protocol;
  command
      ->add_option("--starts", protocol->starts,
                   "Runs of a recording begin at so many instants, evenly over it")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command
      ->add_option("--from", protocol->from_s,
                   "Instants instead, seconds after the first image, separated by commas")
      ->delimiter(',')
      ->check(checkSeconds(true))
      ->allow_extra_args(false);
  command->add_option("--seconds", protocol->seconds, "Length of a run; 0: to the recording's end")
      ->check(checkSeconds(true))
      ->capture_default_str();
  command
      ->add_option("--faults", arguments->faults,
                   "File that names faults (config/faults.ini); without: no faults")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--ate-limit", protocol->ate_limit_m,
                   "A run whose causal ATE is larger has failed, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--seed", protocol->seed, "Of the faults")
      ->check(CLI::Range(0, 2147483647))
      ->capture_default_str();
}

}  // namespace

void addTrialCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<TrialArguments>();
  CLI::App* command = app.add_subcommand(
      "trial",
      "Fly recordings from many starts with every initializer, odometry and setting, without and "
      "with faults, beside other systems' trajectories. Prints what survives and how accurate it "
      "is; writes runs.csv and report.html. An interrupted trial is resumed by the same command.");
  command->add_option("SRC", arguments->sources, kSourceFormats)->required();
  arguments->ground_truth.add(command);
  addVariantOptions(command, arguments.get());
  addProtocolOptions(command, arguments.get());
  arguments->suite.add(command, {"Processes", "Processor time that a run may use",
                                 "How to print the tables; csv: all runs", "Print all tables"});
  arguments->configuration.addConfig(command);
  arguments->configuration.addOverrides(command);
  command->footer(
      "Example: etalon trial /data/euroc/* --initializers etalon,eta,drt --faults "
      "config/faults.ini --out trial\n"
      "Exit codes: 0 done, 2 usage or configuration, 3 a recording could not be used (the others "
      "are done), 4 a run crashed or used up its time (recorded there as crashed or time_limit; "
      "all else is done), 130 interrupted.");
  command->callback([arguments, exit_code] { *exit_code = trial(*arguments); });
}

}  // namespace etalon::app
