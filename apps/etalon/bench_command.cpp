#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>

#include "commands.h"
#include "etalon/benchmark/benchmark.h"
#include "etalon/benchmark/store.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/process/isolated_run.h"
#include "etalon/core/text.h"
#include "etalon/report/benchmark_overview.h"
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

struct BenchArguments {
  std::vector<std::string> sources, initializers;
  std::vector<int> keyframes;
  std::vector<double> rates_hz;
  std::string tracks, vi_ba = "both";
  GroundTruthOption ground_truth;
  ConfigurationOptions configuration;
  double every_s = 2.5, min_coverage = kMinCoverage;
  bool grow = false;
  SuiteOptions suite{"out/bench", kDefaultTimeLimitS};
};

SuiteConfiguration configure(const BenchArguments& arguments) {
  std::vector<std::string> names = arguments.initializers;
  if (names.size() == 1 && names.front() == "all") names.clear();
  return loadSuiteConfiguration(arguments.configuration.ini(), arguments.configuration.plugin_path,
                                names);
}

/**
 * Configures in a child process first, so that a plugin that crashes while it is loaded or made can
 * be named. Exceptions of configure() are thrown here again. @throws PluginError
 */
SuiteConfiguration configureSafely(const BenchArguments& arguments) {
  IsolationLimits limits;
  limits.cpu_s = arguments.suite.time_limit_s;
  const auto configured = [&limits](const BenchArguments& tried) {
    return runIsolated(
        [&tried] {
          try {
            configure(tried);
          } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): thrown again below
          }
          return std::string();
        },
        limits);
  };
  const IsolatedOutcome all = configured(arguments);
  if (all.completed) return configure(arguments);
  for (const std::string& name : arguments.initializers) {
    BenchArguments one = arguments;
    one.initializers = {name};
    const IsolatedOutcome outcome = configured(one);
    if (!outcome.completed)
      throw PluginError("initializer '" + name + "' " + outcome.failure + " while it was loaded");
  }
  throw PluginError("a plugin " + all.failure +
                    " while it was loaded; `etalon check-plugin NAME` tells which");
}

std::string describe(const BenchmarkProgress& p) {
  const std::string left = clockTime(p.remaining_s);
  if (p.stage == BenchmarkProgress::Stage::kFrontEnd)
    return format("bench: front end %zu/%zu frames, %.0f frames/s, %s left", p.done, p.total,
                  static_cast<double>(p.done) / std::max(1e-9, p.elapsed_s), left.c_str());
  return format("bench: windows %zu/%zu, %s left", p.done, p.total, left.c_str());
}

void printNotes(const BenchmarkOutcome& outcome) {
  for (const std::string& note : outcome.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  printRecordingWarnings(outcome.record);
}

int bench(const BenchArguments& arguments) {
  arguments.ground_truth.check(arguments.sources);
  arguments.configuration.requireNotIn(arguments.suite.out);
  const TableFormat format = tableFormatFromName(arguments.suite.format);
  const SuiteConfiguration configuration = configureSafely(arguments);
  const std::string device =
      deviceInWords(arguments.configuration.ini(), configuration.pipeline.device);
  if (!device.empty()) std::fprintf(stderr, "note: %s\n", printable(device).c_str());
  BenchmarkOptions options;
  options.sources = arguments.sources;
  options.ground_truth = arguments.ground_truth.path;
  options.out = arguments.suite.out;
  options.tracks = arguments.tracks;
  options.protocol.every_s = arguments.every_s;
  options.protocol.keyframes = arguments.keyframes;
  if (options.protocol.keyframes.empty())
    options.protocol.keyframes = {configuration.pipeline.keyframes};
  options.protocol.rates_hz = arguments.rates_hz;
  if (options.protocol.rates_hz.empty())
    options.protocol.rates_hz = {configuration.pipeline.keyframe_rate_hz};
  options.protocol.vi_ba = arguments.vi_ba == "both";
  if (arguments.grow) options.protocol.min_keyframes = configuration.pipeline.min_keyframes;
  options.protocol.min_coverage = arguments.min_coverage;
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
  options.stop = stopOnSignals();

  options.report = benchmarkReportHtml;
  const BenchmarkOutcome outcome = runBenchmark(configuration, options);
  line.interrupt();
  printNotes(outcome);
  if (outcome.interrupted) {
    std::fprintf(stderr,
                 "bench: interrupted; %zu results are on disk, %zu are missing; the same command "
                 "goes on from here\n",
                 outcome.results_found + outcome.results_tried, outcome.results_missing);
    return kInterrupted;
  }
  printBenchmarkTables(outcome.record, format, arguments.suite.verbose);
  std::fprintf(stderr,
               "\n%zu results (%zu were there already); front end %s, windows %s\nwritten:\n",
               outcome.results_found + outcome.results_tried, outcome.results_found,
               clockTime(outcome.frontend_s).c_str(), clockTime(outcome.windows_s).c_str());
  for (const std::string& file : outcome.files) std::fprintf(stderr, "  %s\n", file.c_str());
  printShortfalls(outcome.record);
  const bool lost = printLost(outcome.record);
  if (printRecordingErrors(outcome.record)) return kDataErrorExit;
  return lost ? kPluginDied : kOk;
}

/** Checks every number of a list. */
template <typename T>
CLI::Validator within(T min, T max, const std::string& what) {
  return CLI::Range(min, max, what);
}

/** What is tried: initializers and windows. */
void addProtocolOptions(CLI::App* command, BenchArguments* arguments) {
  command
      ->add_option("--initializers", arguments->initializers,
                   "Initializer plugins, separated by commas, or all")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->default_str("all");
  command->add_option("--every", arguments->every_s, "Seconds from window to window")
      ->check(within(0.01, 1e6, "seconds from 0.01 to 1e6"))
      ->capture_default_str();
  command
      ->add_option("--keyframes", arguments->keyframes,
                   "Keyframes of a window; several, separated by commas, are tried each with each "
                   "rate (default: the configuration's, 10)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(within(2, 200, "a whole number from 2 to 200"));
  command
      ->add_option("--rate", arguments->rates_hz,
                   "Keyframes a second; one or several (default: the configuration's, 4)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(within(0.1, 100.0, "a rate from 0.1 to 100 Hz"));
  command->add_flag(
      "--grow", arguments->grow,
      "Windows grow as in a run, from [pipeline] min_keyframes to --keyframes, until a "
      "start is accepted");
  command
      ->add_option("--vi-ba", arguments->vi_ba, "Stages: without and with VI-BA, or without only")
      ->check(CLI::IsMember({"both", "off"}))
      ->capture_default_str();
}

}  // namespace

void addBenchCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App* command = app.add_subcommand(
      "bench",
      "The exhaustive initialization test: every initializer on a window every few seconds of "
      "every recording, without and with VI-BA. Prints one table; writes windows.csv, summary.csv "
      "and report.html. An interrupted benchmark is resumed by the same command.");
  command->add_option("SRC", arguments->sources, kSourceFormats)->required();
  arguments->ground_truth.add(command);
  addProtocolOptions(command, arguments.get());
  command
      ->add_option("--min-coverage", arguments->min_coverage,
                   "Share of the keyframes of a window that must have ground truth; with less, "
                   "errors are not given")
      ->check(checkShare())
      ->capture_default_str();
  command->add_option("--tracks", arguments->tracks,
                      "Folder for the cached tracks of the front end (default: OUT/tracks)");
  arguments->suite.add(
      command, {"Threads of the front end, processes of the windows",
                "Processor time that an initializer, with VI-BA, may use on a window",
                "How to print the tables",
                "As text: a table for each figure with a row for each recording, not one table"});
  arguments->configuration.addConfig(command);
  arguments->configuration.addOverrides(command);
  command->footer(
      glossary() +
      "Example: etalon bench /data/euroc/* --out results\n"
      "Exit codes: 0 done, 2 usage or configuration, 3 a recording could not be used (the others "
      "are done), 4 an initializer crashed, ended the process or used up its time (said at which "
      "window, and recorded there as crashed or time_limit; all else is done), 130 interrupted.");
  command->callback([arguments, exit_code] { *exit_code = bench(*arguments); });
}

}  // namespace etalon::app
