#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "commands.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/process/child_process.h"
#include "etalon/core/text.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/recording_inspection.h"
#include "etalon/pipeline/flight_bias.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/report/run_results.h"
#include "gui/load_flight_window.h"
#include "options/configuration_options.h"
#include "options/fault_option.h"
#include "options/ground_truth_option.h"
#include "options/recording_option.h"
#include "replay/replay_output.h"
#include "replay/replay_run.h"
#include "support/checks.h"
#include "support/stop_on_signals.h"
#include "support/supervised_run.h"

namespace etalon::app {

namespace {

struct ReplayArguments {
  std::string source, out = "out/replay", update_device;
  ConfigurationOptions configuration;
  FaultOption fault;
  GroundTruthOption ground_truth;
  RecordingOptions recording;
  double from_s = 0.0, to_s = 1e18, min_coverage = kMinCoverage;
  double time_limit_s = kDefaultTimeLimitS;
  bool final_ba = false, imu_states = false, gui = false;
};

/** Records the attempt that did not come to its end, with a warning. */
void addLostAttempt(const RunEnd& died, RunRecord* record) {
  record->warnings.push_back(describe(died, record->source) + "; the run ends before that");
  if (died.initializer.empty()) return;
  AttemptRecord attempt;
  attempt.t = died.attempt_t;
  attempt.initializer = record->at_rest_initializer.empty() ? "" : died.initializer;
  attempt.status = died.out_of_time ? kStatusTimeLimit : kStatusCrashed;
  attempt.reason = died.how;
  record->attempts.push_back(std::move(attempt));
}

/** Puts the biases that the odometry found into the device file, or says that it can be done. */
void offerBiases(const ReplayArguments& arguments, const RunConfiguration& configuration,
                 const Pipeline& pipeline) {
  const Expected<FlightBias> bias =
      biasOfFlight(pipeline.estimates(), configuration.pipeline.window.priors);
  const std::string& file = arguments.update_device;
  if (!bias) {
    if (!file.empty())
      std::fprintf(stderr, "warning: device file '%s' stays as it is: %s\n",
                   printable(file).c_str(), bias.error().reason.c_str());
    return;
  }
  std::printf("biases of this flight: %s%s\n", describe(*bias).c_str(),
              file.empty() ? "; add them by --update-device FILE" : "");
  if (!file.empty())
    std::printf("%s\n",
                printable(updateDeviceFile(file, recordingName(arguments.source), *bias)).c_str());
}

/** Where every attempt was refused, most because the data contradict each other: what may be wrong. */
void suspectCause(const ReplayArguments& arguments, const RunRecord& record) {
  const auto& attempts = record.attempts;
  if (attempts.empty() || record.acceptedAttempt()) return;
  const auto contradict = std::count_if(attempts.begin(), attempts.end(), [](const auto& attempt) {
    return attempt.status == toString(RefusalStatus::kNotConverged);
  });
  if (2 * static_cast<size_t>(contradict) < attempts.size()) return;
  std::vector<std::string> causes;
  try {
    causes = suspectedByMotion(arguments.source, arguments.recording);
  } catch (const DataError&) {  // the run has said what cannot be read
  }
  if (causes.empty())
    causes.emplace_back(
        "T_BS, the axes or a sign of the accelerometer, or noise above what [imu_noise] and "
        "sigma_px say");
  for (const std::string& cause : causes)
    std::printf("a cause may be: %s\n", printable(cause).c_str());
}

/** The run itself, in a process of its own. @param died see ReplayRun */
int replayHere(const ReplayArguments& arguments, RunState* state, const RunEnd* died) {
  const IniFile ini = arguments.configuration.ini();
  RunConfiguration configuration = loadRunConfiguration(ini, arguments.configuration.plugin_path);
  // An earlier run may have died of the adjustment.
  configuration.pipeline.final_ba = arguments.final_ba && !died;
  PipelineInitializers& initializers = configuration.initializers;
  initializers.initializer = watched(initializers.initializer, initializers.name, state);
  if (initializers.at_rest)
    initializers.at_rest = watched(initializers.at_rest, initializers.at_rest_name, state);
  SourceOptions source_options;
  source_options.from_s = arguments.from_s;
  source_options.to_s = arguments.to_s;
  source_options.recording = arguments.recording;
  source_options.ground_truth = arguments.ground_truth.of(arguments.source);
  const auto source = arguments.fault.apply(
      [&] { return openSource(arguments.source, source_options); }, arguments.from_s);
  const std::string device = deviceInWords(ini, configuration.pipeline.device);
  if (!died && !device.empty()) std::printf("%s\n", printable(device).c_str());
  if (!died)
    for (const std::string& warning : requireSoundRecording(arguments.source, arguments.recording))
      std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
  // A folder that cannot be written should not be noticed after minutes of work.
  const bool new_folder = makeFolder(arguments.out);
  { const OutputFiles writable(arguments.out); }
  ReplayRun run(source.get(), configuration, state, died);
  if (arguments.imu_states) run.keepImuStates();
  if (arguments.gui && !died) run.openWindow();
  // The part before an error is still finished and written.
  std::exception_ptr failure;
  const auto keepFailure = [&failure](const auto& step) {
    try {
      step();
    } catch (const std::exception&) {
      if (!failure) failure = std::current_exception();
    }
  };
  keepFailure([&run] { run.run(); });
  std::string interrupted = run.interruptedAt();
  if (run.delivered() == 0 && (failure || !interrupted.empty())) {
    // An earlier run in the folder stays as it is.
    std::error_code ignored;
    if (new_folder) std::filesystem::remove(arguments.out, ignored);
    if (failure) std::rethrow_exception(failure);
    std::fprintf(stderr, "replay: interrupted before the first image; nothing is written\n");
    return kInterrupted;
  }
  keepFailure([&run] { run.finish(); });
  FinishedRun finished = run.finished(arguments.min_coverage);
  if (configuration.pipeline.final_ba) keepFailure([&] { run.adjust(&finished); });
  RunRecord record = makeRunRecord(finished);
  if (died) addLostAttempt(*died, &record);
  if (!interrupted.empty())
    record.warnings.push_back("the run was interrupted at " + interrupted + " and ends there");
  if (configuration.pipeline.final_ba && !finished.final_flight && !run.adjustmentStopped())
    record.warnings.emplace_back(
        "the final bundle adjustment failed: there is no trajectory_final.tum");
  if (run.adjustmentStopped())
    record.warnings.push_back(
        "the final bundle adjustment was interrupted: there is no trajectory_final.tum");
  RunFiles files;
  try {
    files = writeRunResults(arguments.out, finished, record);
  } catch (const DataError& e) {  // the summary is printed all the same
    files.failures.emplace_back(e.what());
  }
  const bool part = arguments.from_s > 0.0 || arguments.to_s < 1e18 || !interrupted.empty();
  printSummary(record, finished, files.written, part);
  if (!failure && !died && interrupted.empty()) suspectCause(arguments, record);
  if (!failure && !died) offerBiases(arguments, configuration, run.pipeline());
  if (interrupted.empty() && run.adjustmentStopped()) interrupted = "the final bundle adjustment";
  if (interrupted.empty()) run.waitForWindow();
  if (!files.failures.empty())
    throw DataError("", 0, "not all results could be written: " + joined(files.failures, "; "));
  if (failure) std::rethrow_exception(failure);
  if (!interrupted.empty()) {
    std::fprintf(stderr, "replay: interrupted at %s; what was flown is written%s\n",
                 interrupted.c_str(),
                 run.adjustmentStopped() ? ", without trajectory_final.tum" : "");
    return kInterrupted;
  }
  return run.pipeline().initializedAt() ? kOk : kNotInitialized;
}

/** A crash loses the results of its process, so the run is repeated, bit for bit, up to it. */
int replay(const ReplayArguments& arguments) {
  if (!(arguments.from_s < arguments.to_s))
    throw ConfigError("replay: --from must be less than --to");
  if (arguments.gui) loadFlightWindow();
  // A file that cannot be updated should not be noticed after minutes of work.
  if (std::filesystem::exists(arguments.update_device))
    DeviceFile::fromIni(IniFile::fromFile(arguments.update_device));
  arguments.configuration.requireNotIn(arguments.out);
  const std::atomic<bool>* stop = stopOnSignals();
  const auto run = [&arguments, stop](const RunEnd* died) {
    return runSupervised(
        arguments.time_limit_s,
        [&arguments, died](RunState& state) { return replayHere(arguments, &state, died); }, stop);
  };
  const RunEnd end = run(nullptr);
  if (end.finished) return end.exit_code;
  std::fprintf(stderr, "etalon: %s\n", printable(describe(end, arguments.source)).c_str());
  if (!end.processed) return kPluginDied;
  std::fprintf(stderr, "replay: keeping what came before%s\n",
               arguments.final_ba ? ", without the final bundle adjustment" : "");
  const RunEnd before = run(&end);
  if (!before.finished)
    std::fprintf(stderr, "etalon: nothing could be kept: %s\n",
                 printable(describe(before, arguments.source)).c_str());
  return kPluginDied;
}

}  // namespace

void addReplayCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand(
      "replay",
      "Run the pipeline on a recording: initialize through a plugin, then odometry in the "
      "gravity-aligned frame. Writes trajectory, initialization.json, run.rawlog, a picture and "
      "the effective configuration.");
  command->add_option("SRC", arguments->source, kSourceFormats)->required();
  arguments->configuration.addConfig(command);
  arguments->configuration.addInitializer(command);
  command->add_option("--from", arguments->from_s, "Start, seconds after the first image")
      ->check(checkSeconds(true));
  command->add_option("--to", arguments->to_s, "End, seconds after the first image")
      ->check(checkSeconds(false));
  arguments->fault.add(command);
  arguments->ground_truth.add(command);
  arguments->configuration.addOverrides(command);
  command
      ->add_option("--min-coverage", arguments->min_coverage,
                   "Share of the frames, and of a window's keyframes, that must have ground truth; "
                   "with less, errors are not given")
      ->check(checkShare())
      ->capture_default_str();
  addTimeLimitOption(command, "Processor time that the initializer may use in an attempt",
                     &arguments->time_limit_s);
  command->add_flag("--imu-states", arguments->imu_states,
                    "Write states_imu.csv, too: pose and velocity at every IMU sample");
  command->add_flag("--final-ba", arguments->final_ba,
                    "After the run, adjust all keyframes together, images and IMU: "
                    "trajectory_final.tum");
  command
      ->add_option("--update-device", arguments->update_device,
                   "Device file to which the biases of this flight are added; made if need be. A "
                   "recording that it has is replaced")
      ->check(checkOutputPath());
  addRecordingOptions(command, &arguments->recording);
  command->add_flag("--gui", arguments->gui,
                    "Show the flight in 3-D and the left image with its tracks while it runs");
  command->add_option("--out", arguments->out, "Folder for the results")
      ->check(checkOutputPath())
      ->capture_default_str();
  command->footer(
      "Exit codes: 0 initialized, 1 never initialized (reasons printed), 2 usage or configuration, "
      "3 data, 4 the initializer crashed, ended the process or used up its time (said when; what "
      "came before is written), 130 interrupted (what was flown is written; a second Ctrl-C ends "
      "at once).");
  command->callback([arguments, exit_code] { *exit_code = replay(*arguments); });
}

}  // namespace etalon::app
