#include "replay/replay_output.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>

#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/frontend/keyframe_selector.h"
#include "support/print_stage_errors.h"
#include "support/read_summary.h"

namespace etalon::app {

/** Keyframes of the first window that is tried. */
static int firstWindow(const PipelineOptions& options) {
  return options.windowsGrow() ? options.min_keyframes : options.keyframes;
}

std::string describeProgress(const Pipeline& pipeline, const PipelineOptions& options,
                             double seconds, double elapsed_s) {
  const double rate = static_cast<double>(pipeline.timings().size()) / std::max(1e-9, elapsed_s);
  std::string state = toString(pipeline.state());
  if (!pipeline.initializedAt())
    state = pipeline.attempts().empty()
                ? "collecting keyframes " + std::to_string(pipeline.keyframesCollected()) + "/" +
                      std::to_string(firstWindow(options))
                : "not yet (" + std::to_string(pipeline.attemptCount()) + " attempts)";
  return format("replay: %7.2f s  %5.1f frames/s  %s", seconds, rate, state.c_str());
}

void printAttempt(const InitializationAttempt& attempt, const Pipeline& pipeline,
                  const std::string& at_rest, TimeNs first_image) {
  const std::string& name = attempt.initializer;  // empty without `auto`
  const bool started = pipeline.initializedAt() && attempt.t > *pipeline.initializedAt();
  std::string text;
  if (!attempt.accepted()) {
    const bool waits = started && pipeline.waitsForMotion() && name == at_rest;
    text = (name.empty() ? "" : name + ": ") +
           (waits ? "still waiting for motion, because " : "not yet, because ") +
           attempt.decision.error().reason;
  } else if (pipeline.handedOverAt() == attempt.t) {
    text = "handed over to " + name;
  } else {
    text = (started ? "initialized again" : "initialized") + (name.empty() ? "" : " by " + name);
  }
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

namespace {

/** Errors and times of an accepted attempt. */
void printAccepted(const AttemptRecord& attempt) {
  for (const StageRecord& stage : attempt.stages) printStageErrors(stage);
  const double odometry_ms = attempt.milliseconds(kTimingStereoOdometry);
  if (!std::isnan(odometry_ms)) std::printf("  stereo odometry %.1f ms\n", odometry_ms);
  if (attempt.extrinsics)
    std::printf(
        "  left camera in the body: %.2f deg and %.1f cm from where the calibration has it\n",
        attempt.extrinsics->rotation_deg, 100.0 * attempt.extrinsics->translation_m);
  std::printf("  initializer %.2f ms, VI-BA %.1f ms\n", attempt.milliseconds(kTimingInitialize),
              attempt.milliseconds(kTimingViBa));
}

/** With `initializer = auto`: which initializer started, which took over, and their errors. */
void printAutoSummary(const RunRecord& record) {
  std::vector<const AttemptRecord*> accepted;
  std::string text;
  for (size_t i = 0; i < record.attempts.size(); ++i) {
    const AttemptRecord& attempt = record.attempts[i];
    if (!attempt.accepted()) continue;
    const std::string when =
        format(" at %.2f s (attempt %zu)", secondsBetween(record.first_image, attempt.t), i + 1);
    text += (accepted.empty() ? "" : "; ") + attempt.initializer +
            (accepted.empty() ? " initialized" : " took over") + when;
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

/** The moment of a run's last change to "lost" from `begin` on and up to `end`, if there was one. */
std::optional<TimeNs> lostBetween(const RunRecord& record, TimeNs begin, TimeNs end) {
  std::optional<TimeNs> lost;
  for (const EventRecord& event : record.events)
    if (event.state == toString(PipelineState::kLost) && !event.remark && begin <= event.t &&
        event.t <= end)
      lost = event.t;
  return lost;
}

/** "after 2 attempts, 0.75 s after the first image; lost at 13.00 s, initialized again at 15.80 s
 * after 11 more": the starts of a run that was initialized. */
std::string startsInWords(const RunRecord& record) {
  const auto at = [&record](TimeNs t) {
    return format("%.2f s", secondsBetween(record.first_image, t));
  };
  std::string text;
  TimeNs started = record.first_image;
  size_t attempts = 0;  // since the last start
  for (const AttemptRecord& attempt : record.attempts) {
    ++attempts;
    if (!attempt.accepted()) continue;
    if (text.empty()) {
      text =
          "after " + counted(attempts, "attempt") + ", " + at(attempt.t) + " after the first image";
    } else {
      const std::optional<TimeNs> lost = lostBetween(record, started, attempt.t);
      text += (lost ? "; lost at " + at(*lost) + "," : ";") + " initialized again at " +
              at(attempt.t) + " after " + std::to_string(attempts) + " more";
    }
    started = attempt.t;
    attempts = 0;
  }
  if (const auto lost = lostBetween(record, started, std::numeric_limits<TimeNs>::max()))
    text += "; lost at " + at(*lost) + " and not initialized again" +
            (attempts > 0 ? " in " + std::to_string(attempts) + " more" : "");
  return text;
}

/** ", 9 of 100 frames": the part of the trajectory that an error covers; empty for all of it. */
std::string partly(const RunRecord& record) {
  if (!record.ground_truth || record.ground_truth->covered_frames == record.ground_truth->frames)
    return "";
  return ", " + std::to_string(record.ground_truth->covered_frames) + " of " +
         std::to_string(record.ground_truth->frames) + " frames have ground truth";
}

/** The most keyframes that a window can have if it begins anew where images are more than
 * `max_gap_s` apart. */
int mostKeyframes(const std::vector<StereoReference>& images, double rate_hz, double max_gap_s) {
  KeyframeSelector selector(KeyframeSelectorOptions{rate_hz});
  int most = 0, count = 0;
  for (size_t i = 0; i < images.size(); ++i) {
    if (i > 0 && secondsBetween(images[i - 1].t, images[i].t) > max_gap_s) {
      selector = KeyframeSelector(KeyframeSelectorOptions{rate_hz});
      count = 0;
    }
    count += selector.isKeyframe(images[i].t);
    most = std::max(most, count);
  }
  return most;
}

/** Why a run had no attempt. */
std::string whyNoAttempt(const FinishedRun& run, bool part) {
  const PipelineOptions& options = run.configuration.pipeline;
  const int wanted = firstWindow(options);
  const auto isMissed = [&](double max_gap_s) {
    return mostKeyframes(run.images, options.keyframe_rate_hz, max_gap_s) < wanted;
  };
  if (isMissed(std::numeric_limits<double>::infinity()))
    return std::string("the ") + (part ? "part" : "recording") +
           " is shorter than the window of keyframes";
  if (isMissed(options.input.max_gap_s))
    return format(
        "the images are too far apart for a window of %d keyframes, which begins anew after a gap "
        "of more than %g s ([input] max_gap_s)",
        wanted, options.input.max_gap_s);
  return format("at no time could %d keyframes in a row be tracked", wanted);
}

/** "; the last: ...", and what most were refused for, where that is something else. */
std::string refusalsInWords(const std::vector<AttemptRecord>& attempts) {
  const auto kind = [](const AttemptRecord& attempt) { return withoutFigures(attempt.reason); };
  std::map<std::string, size_t> count;
  for (const AttemptRecord& attempt : attempts) ++count[kind(attempt)];
  const AttemptRecord& last = attempts.back();
  const AttemptRecord* frequent = &last;
  for (const AttemptRecord& attempt : attempts)
    if (count[kind(attempt)] >= 2 * count[kind(*frequent)]) frequent = &attempt;
  std::string text = "; the last: " + last.reason;
  if (kind(*frequent) != kind(last))
    text += format("\n  %zu of them: ", count[kind(*frequent)]) + frequent->reason;
  return text;
}

}  // namespace

void printSummary(const RunRecord& record, const FinishedRun& run,
                  const std::vector<std::string>& files, bool part) {
  const AttemptRecord* attempt = record.acceptedAttempt();
  if (attempt && !record.at_rest_initializer.empty()) {
    printAutoSummary(record);
  } else if (attempt) {
    std::printf("\n%s initialized %s\n", record.initializer.c_str(), startsInWords(record).c_str());
    printAccepted(*attempt);
  } else {
    const std::string why =
        record.attempts.empty() ? ": " + whyNoAttempt(run, part) : refusalsInWords(record.attempts);
    std::printf("\n%s never initialized in %zu attempts%s\n", record.initializer.c_str(),
                record.attempts.size(), why.c_str());
  }
  const RunStatistics& s = record.statistics;
  std::printf("%s, %.1f s", counted(static_cast<size_t>(s.stereo_frames), "stereo frame").c_str(),
              s.duration_s);
  if (!std::isnan(s.frame_median_ms)) std::printf(", %.1f ms a frame (median)", s.frame_median_ms);
  if (record.trajectory_errors)
    std::printf(", ATE of the whole trajectory %.3f m (SE(3)-aligned%s)",
                record.trajectory_errors->position_m.rmse, partly(record).c_str());
  std::printf("\n");
  for (const StageTimes& stage : s.stages)
    if (stage.frames > 0)
      std::printf(
          "  %-15s %7d frames  median %7.2f ms  99 %% %7.2f ms  longest %7.2f ms  %6.1f s\n",
          stage.stage.c_str(), stage.frames, stage.median_ms, stage.p99_ms, stage.max_ms,
          stage.total_s);
  if (record.smoothed_errors)
    std::printf("smoothed with later measurements: ATE of trajectory_smoothed.tum %.4f m",
                record.smoothed_errors->position_m.rmse);
  if (record.final_errors)
    std::printf(", of trajectory_final.tum %.4f m", record.final_errors->position_m.rmse);
  if (record.smoothed_errors) std::printf("\n");
  if (const auto& ba = record.final_ba)
    std::printf(
        "final bundle adjustment of %d keyframes and %d landmarks: %s in %d iterations, "
        "%.1f s\n",
        ba->keyframes, ba->landmarks, ba->termination.c_str(), ba->iterations, ba->wall_s);
  if (!record.calibration.empty()) std::printf("calibration:\n");
  for (const CalibrationRecord& finding : record.calibration)
    std::printf("  %s\n", finding.words.c_str());
  if (s.unpaired_left + s.unpaired_right > 0)
    std::printf("%d left and %d right images without a partner were left out\n", s.unpaired_left,
                s.unpaired_right);
  if (s.frames_not_located > 0)
    std::printf(
        "%s could not be located: %s\n", counted(s.frames_not_located, "frame").c_str(),
        s.frames_not_located == 1 ? "its pose is a prediction" : "their poses are predictions");
  printReadProblems(s.unreadable_images, record.warnings);
  if (!files.empty()) std::printf("written:\n");
  for (const std::string& file : files) std::printf("  %s\n", file.c_str());
}

std::string describe(const RunEnd& end, const std::string& source) {
  std::string when;
  if (end.first_image)
    when = format(" at %.2f s",
                  secondsBetween(*end.first_image, !end.initializer.empty() ? end.attempt_t
                                                   : end.processed          ? *end.processed
                                                                            : *end.first_image));
  if (end.initializer.empty())
    return "the run " + end.how + when + " of " + source + ", outside of the initializer's call";
  return end.initializer + " " + end.how + when + " of " + source + ", in its attempt number " +
         std::to_string(end.attempts);
}

}  // namespace etalon::app
