#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "commands.h"
#include "etalon/core/child_process.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/stopwatch.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/recording_inspection.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/report/run_results.h"
#include "support/checks.h"
#include "support/configuration_options.h"
#include "support/print_stage_errors.h"
#include "support/progress_line.h"
#include "support/read_summary.h"
#include "support/supervised_run.h"
#include "support/versions.h"

namespace etalon::app {

namespace {

struct Arguments {
  std::string source, out = "out/replay";
  ConfigurationOptions configuration;
  double from_s = 0.0, to_s = 1e18, min_coverage = kMinCoverage;
  double time_limit_s = kDefaultTimeLimitS;
};

/** The live line: time in the recording, frames per second, state. */
std::string describeProgress(const Pipeline& pipeline, const PipelineOptions& options,
                             double seconds, double elapsed_s) {
  const double rate = static_cast<double>(pipeline.timings().size()) / std::max(1e-9, elapsed_s);
  std::string state = toString(pipeline.state());
  if (!pipeline.initializedAt())
    state = pipeline.attempts().empty()
                ? "collecting keyframes " + std::to_string(pipeline.keyframesCollected()) + "/" +
                      std::to_string(options.keyframes)
                : "not yet (" + std::to_string(pipeline.attempts().size()) + " attempts)";
  char text[120];
  std::snprintf(text, sizeof text, "replay: %7.2f s  %5.1f frames/s  %s", seconds, rate,
                state.c_str());
  return text;
}

/**
 * @param handover whether the odometry ran already, started at rest
 * @param at_rest name of the initializer at rest; empty if there is none
 */
void printAttempt(const InitializationAttempt& attempt, TimeNs first_image, bool handover,
                  const std::string& at_rest) {
  std::string text = attempt.accepted() ? (handover ? "handed over" : "initialised")
                                        : "not yet, because " + attempt.decision.error().reason;
  if (handover && attempt.initializer == at_rest)
    text = "still waiting for motion, because " + attempt.decision.error().reason;
  if (!attempt.initializer.empty())
    text = attempt.accepted() ? text + (handover ? " to " : " by ") + attempt.initializer
                              : attempt.initializer + ": " + text;
  std::printf("%8.2f s  %s\n", secondsBetween(first_image, attempt.t), text.c_str());
  std::fflush(stdout);
}

void printEvent(const PipelineEvent& event, TimeNs first_image) {
  std::printf("%8.2f s  %s: %s\n", secondsBetween(first_image, event.t), toString(event.state),
              event.reason.c_str());
  if (event.jump)
    std::printf("            the pose jumped by %.3f m and may be off by %.3f m\n",
                event.jump->T_before_after.t.norm(),
                std::sqrt(event.jump->covariance.diagonal().tail<3>().sum()));
  std::fflush(stdout);
}

/** The pipeline's run over the source; what was read before an error is kept in `pipeline`. */
class Replay {
 public:
  /** @param died how a former run of the same ended too early: this one ends before that, and
   * reports nothing on the way; null: there was none */
  Replay(SensorSource* source, const RunConfiguration& configuration, RunState* state,
         const RunEnd* died)
      : source_(*source),
        configuration_(configuration),
        state_(*state),
        died_(died),
        pipeline_(source->calibration(), configuration.pipeline, configuration.initializers) {}

  void run() {
    while (const auto event = source_.next()) {
      if (const auto* sample = std::get_if<ImuSample>(&*event)) {
        pipeline_.add(*sample);
      } else {
        const StereoFrame& frame = std::get<StereoFrame>(*event);
        if (died_ && truncateToMrptTick(frame.t) > truncateToMrptTick(*died_->processed)) return;
        if (images_.empty()) state_.first_image = frame.t;
        images_.push_back({frame.t, absolute(frame.left_path), absolute(frame.right_path)});
        pipeline_.add(frame);
      }
      report(false);
    }
  }

  void finish() {
    pipeline_.finish();
    report(true);
  }

  FinishedRun finished(double min_coverage) {
    return {source_,    configuration_, pipeline_, images_, 1e-3 * watch_.lapMilliseconds(),
            versions(), min_coverage};
  }

  const Pipeline& pipeline() const { return pipeline_; }
  size_t delivered() const { return images_.size(); }

 private:
  static std::string absolute(const std::string& path) {
    return path.empty() ? path : std::filesystem::absolute(path).lexically_normal().string();
  }

  void report(bool last) {
    if (!pipeline_.trajectory().empty()) state_.processed = pipeline_.trajectory().back().t;
    if (died_) return;
    for (; reported_ < pipeline_.attempts().size(); ++reported_) {
      progress_.interrupt();
      const InitializationAttempt& attempt = pipeline_.attempts()[reported_];
      const bool handover = pipeline_.initializedAt() && attempt.t > *pipeline_.initializedAt();
      printAttempt(attempt, images_.front().t, handover, configuration_.initializers.at_rest_name);
    }
    for (; events_reported_ < pipeline_.events().size(); ++events_reported_) {
      const PipelineEvent& event = pipeline_.events()[events_reported_];
      if (event.state == PipelineState::kVisual) continue;
      progress_.interrupt();
      printEvent(event, images_.front().t);
    }
    progress_.update(last, [this] {
      const double seconds =
          images_.empty() ? 0.0 : secondsBetween(images_.front().t, images_.back().t);
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
      return describeProgress(pipeline_, configuration_.pipeline, seconds, elapsed.count());
    });
  }

  SensorSource& source_;
  const RunConfiguration& configuration_;
  RunState& state_;
  const RunEnd* died_;
  Pipeline pipeline_;
  std::vector<StereoReference> images_;
  ProgressLine progress_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Stopwatch watch_;
  size_t reported_ = 0, events_reported_ = 0;
};

/** Errors and times of an accepted attempt. */
void printAccepted(const AttemptRecord& attempt) {
  for (const StageRecord& stage : attempt.stages) printStageErrors(stage);
  const double odometry_ms = attempt.milliseconds(kTimingStereoOdometry);
  if (!std::isnan(odometry_ms)) std::printf("  stereo odometry %.1f ms\n", odometry_ms);
  std::printf("  initializer %.2f ms, VI-BA %.1f ms\n", attempt.milliseconds(kTimingInitialize),
              attempt.milliseconds(kTimingViBa));
}

/** With `initializer = auto`: who started, who took over, and the errors of each. */
void printAutoSummary(const RunRecord& record) {
  std::vector<const AttemptRecord*> accepted;
  std::string text;
  for (size_t i = 0; i < record.attempts.size(); ++i) {
    const AttemptRecord& attempt = record.attempts[i];
    if (!attempt.accepted()) continue;
    char when[64];
    std::snprintf(when, sizeof when, " at %.2f s (attempt %zu)",
                  secondsBetween(record.first_image, attempt.t), i + 1);
    text += (accepted.empty() ? "" : "; ") + attempt.initializer +
            (accepted.empty() ? " initialised" : " took over") + when;
    accepted.push_back(&attempt);
  }
  if (accepted.front()->initializer == record.at_rest_initializer && !record.handed_over_at)
    text += "; no other one took over";
  std::printf("\n%s\n", text.c_str());
  for (const AttemptRecord* attempt : accepted) {
    std::printf("%s:\n", attempt->initializer.c_str());
    printAccepted(*attempt);
  }
}

/** ", 9 of 100 frames": how much of the trajectory an error is of, if not all. */
std::string partly(const RunRecord& record) {
  if (!record.ground_truth || record.ground_truth->covered_frames == record.ground_truth->frames)
    return "";
  return ", " + std::to_string(record.ground_truth->covered_frames) + " of " +
         std::to_string(record.ground_truth->frames) + " frames have ground truth";
}

void printSummary(const RunRecord& record, const std::vector<std::string>& files) {
  const AttemptRecord* attempt = record.acceptedAttempt();
  if (attempt && !record.at_rest_initializer.empty()) {
    printAutoSummary(record);
  } else if (attempt) {
    std::printf("\n%s initialised after %zu attempt%s, %.2f s after the first image\n",
                record.initializer.c_str(), record.attempts.size(),
                record.attempts.size() == 1 ? "" : "s",
                secondsBetween(record.first_image, attempt->t));
    printAccepted(*attempt);
  } else {
    std::printf("\n%s never initialised in %zu attempts%s%s\n", record.initializer.c_str(),
                record.attempts.size(), record.attempts.empty() ? "" : "; the last: ",
                record.attempts.empty() ? ": the recording is shorter than the window of keyframes"
                                        : record.attempts.back().reason.c_str());
  }
  const RunStatistics& s = record.statistics;
  std::printf("%s, %.1f s", counted(static_cast<size_t>(s.stereo_frames), "stereo frame").c_str(),
              s.duration_s);
  if (!std::isnan(s.frame_median_ms)) std::printf(", %.1f ms a frame (median)", s.frame_median_ms);
  if (record.trajectory_errors)
    std::printf(", ATE of the whole trajectory %.3f m (SE(3)-aligned%s)",
                record.trajectory_errors->position_m.rmse, partly(record).c_str());
  std::printf("\n");
  if (s.unpaired_left + s.unpaired_right > 0)
    std::printf("%d left and %d right images without a partner were left out\n", s.unpaired_left,
                s.unpaired_right);
  if (s.frames_not_located > 0)
    std::printf(
        "%s could not be located: %s\n",
        counted(static_cast<size_t>(s.frames_not_located), "frame").c_str(),
        s.frames_not_located == 1 ? "its pose is a prediction" : "their poses are predictions");
  printReadProblems(s.unreadable_images, record.warnings);
  std::printf("written:\n");
  for (const std::string& file : files) std::printf("  %s\n", file.c_str());
}

/** "misbehaves crashed with signal 11 (Segmentation fault) at 2.25 s of RECORDING, in attempt 3".
 */
std::string describe(const RunEnd& end, const std::string& source) {
  char when[64] = "";
  if (end.first_image)
    std::snprintf(when, sizeof when, " at %.2f s",
                  secondsBetween(*end.first_image, !end.initializer.empty() ? end.attempt_t
                                                   : end.processed          ? *end.processed
                                                                            : *end.first_image));
  if (end.initializer.empty())
    return "the run " + end.how + when + " of " + source + ", outside of the initializer's call";
  return end.initializer + " " + end.how + when + " of " + source + ", in its attempt number " +
         std::to_string(end.attempts);
}

/** The attempt that did not come to its end, and words about it. */
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

/** The run itself, in a process of its own. @param died see Replay */
int replayHere(const Arguments& arguments, RunState* state, const RunEnd* died) {
  RunConfiguration configuration =
      loadRunConfiguration(arguments.configuration.ini(), arguments.configuration.plugin_path);
  PipelineInitializers& initializers = configuration.initializers;
  initializers.initializer = watched(initializers.initializer, initializers.name, state);
  if (initializers.at_rest)
    initializers.at_rest = watched(initializers.at_rest, initializers.at_rest_name, state);
  SourceOptions source_options;
  source_options.from_s = arguments.from_s;
  source_options.to_s = arguments.to_s;
  const auto source = openSource(arguments.source, source_options);
  if (!died)
    for (const std::string& warning : requireSoundRecording(arguments.source))
      std::fprintf(stderr, "warning: %s\n", printable(warning).c_str());
  // What cannot be written should not show after minutes of work.
  const bool new_folder = makeFolder(arguments.out);
  Replay run(source.get(), configuration, state, died);
  std::exception_ptr failure;
  try {
    run.run();
  } catch (const DataError&) {  // what came before it is finished and written all the same
    failure = std::current_exception();
  }
  if (failure && run.delivered() == 0) {  // an earlier run in the folder stays as it is
    std::error_code ignored;
    if (new_folder) std::filesystem::remove(arguments.out, ignored);
    std::rethrow_exception(failure);
  }
  run.finish();
  const FinishedRun finished = run.finished(arguments.min_coverage);
  RunRecord record = makeRunRecord(finished);
  if (died) addLostAttempt(*died, &record);
  printSummary(record, writeRunResults(arguments.out, finished, record));
  if (failure) std::rethrow_exception(failure);
  return run.pipeline().initializedAt() ? kOk : kNotInitialised;
}

/** What a crash takes with it is done once more, up to the crash: the same again, bit by bit. */
int replay(const Arguments& arguments) {
  if (!(arguments.from_s < arguments.to_s))
    throw ConfigError("replay: --from must be less than --to");
  const auto run = [&arguments](const RunEnd* died) {
    return runSupervised(arguments.time_limit_s, [&arguments, died](RunState& state) {
      return replayHere(arguments, &state, died);
    });
  };
  const RunEnd end = run(nullptr);
  if (end.finished) return end.exit_code;
  std::fprintf(stderr, "etalon: %s\n", printable(describe(end, arguments.source)).c_str());
  if (!end.processed) return kPluginDied;
  std::fprintf(stderr, "replay: keeping what came before\n");
  const RunEnd before = run(&end);
  if (!before.finished)
    std::fprintf(stderr, "etalon: nothing could be kept: %s\n",
                 printable(describe(before, arguments.source)).c_str());
  return kPluginDied;
}

}  // namespace

void addReplayCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "replay",
      "Run the pipeline on a recording: initialise through a plugin, then odometry in the "
      "gravity-aligned frame. Writes trajectory, initialization.json, run.rawlog, a picture and "
      "the effective configuration.");
  command->add_option("SRC", arguments->source, "EuRoC folder or .rawlog")->required();
  arguments->configuration.addConfig(command);
  arguments->configuration.addInitializer(command);
  command->add_option("--from", arguments->from_s, "Start, seconds after the first image")
      ->check(checkSeconds(true));
  command->add_option("--to", arguments->to_s, "End, seconds after the first image")
      ->check(checkSeconds(false));
  arguments->configuration.addOverrides(command);
  command
      ->add_option("--min-coverage", arguments->min_coverage,
                   "Share of the frames, and of a window's keyframes, that must have ground truth; "
                   "with less, errors are not given")
      ->check(checkShare())
      ->capture_default_str();
  addTimeLimitOption(command, "Processor time that the initializer may use in an attempt",
                     &arguments->time_limit_s);
  command->add_option("--out", arguments->out, "Folder for the results")
      ->check(checkOutputPath())
      ->capture_default_str();
  command->footer(
      "Exit codes: 0 initialised, 1 never initialised (reasons printed), 2 usage or configuration, "
      "3 data, 4 the initializer crashed, ended the process or used up its time (said when; what "
      "came before is written).");
  command->callback([arguments, exit_code] { *exit_code = replay(*arguments); });
}

}  // namespace etalon::app
