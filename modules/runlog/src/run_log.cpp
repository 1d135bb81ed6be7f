#include "etalon/runlog/run_log.h"

#include <mrpt/obs/CObservationComment.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_observations.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recording_comment.h"

namespace etalon {
namespace {

/** The attempt whose keyframes go into the log; null if none has states. */
const AttemptRecord* attemptToLog(const RunRecord& record) {
  if (const AttemptRecord* accepted = record.acceptedAttempt()) return accepted;
  for (auto attempt = record.attempts.rbegin(); attempt != record.attempts.rend(); ++attempt)
    if (!attempt->stages.empty()) return &*attempt;
  return nullptr;
}

/** An observation of the log. It is made only when it is written: those of a long run, all at once,
 * would take more memory than the run itself. */
struct Entry {
  mrpt::Clock::time_point t;
  std::function<void(RawlogWriter*)> write;
};

/** The observations of a run in time order; they borrow the log. */
std::vector<Entry> entriesOf(const RunLog& log) {
  std::vector<Entry> entries;
  const auto add = [&entries](TimeNs t, std::function<void(RawlogWriter*)> write) {
    entries.push_back({toMrptTime(t), std::move(write)});
  };
  for (const StereoReference& image : log.images) {
    if (image.left_path.empty() || image.right_path.empty()) continue;
    add(image.t, [&log, &image](RawlogWriter* writer) {
      StereoFrame frame;
      frame.t = image.t;
      frame.left_path = image.left_path;
      frame.right_path = image.right_path;
      writer->write(toObservation(frame, log.calibration, true));
    });
  }
  if (const AttemptRecord* attempt = attemptToLog(log.record))
    for (const StageRecord& stage : attempt->stages)
      for (const StampedState& state : stage.states)
        add(state.t, [&log, &stage, &state](RawlogWriter* writer) {
          writer->write(
              toObservation({state.t, state.T_WB}, log.record.initializer + "/" + stage.stage));
        });
  for (const FrameEstimate& estimate : log.estimates)
    add(estimate.t, [&log, &estimate](RawlogWriter* writer) {
      writer->write(toObservation({estimate.t, estimate.nav.T_WB},
                                  log.record.initializer + "/odometry", estimate.pose_covariance));
    });
  if (!log.estimates.empty())
    for (const StampedState& state : log.ground_truth.states)
      if (state.t >= log.estimates.front().t && state.t <= log.estimates.back().t)
        add(state.t, [&state](RawlogWriter* writer) {
          writer->write(toObservation({state.t, state.T_WB}, kGroundTruthLabel));
        });
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.t < b.t; });
  return entries;
}

}  // namespace

void writeRunLog(const std::string& path, const RunLog& log) {
  const std::vector<Entry> entries = entriesOf(log);
  RawlogWriter writer(path);
  const TimeNs first = entries.empty() ? log.record.first_image : fromMrptTime(entries.front().t);
  writer.write(commentObservation(first, toJson(log.record)));
  for (const Entry& entry : entries) entry.write(&writer);
  writer.close();
}

RunRecord readRunRecord(const std::string& run) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string path =
      fs::is_directory(run, ignored) ? (fs::path(run) / kRunLogName).string() : run;
  if (!fs::is_regular_file(path, ignored))
    throw DataError(path, 0, "there is no such file; expected the log of a run (etalon replay)");
  RawlogObservations observations(path);
  while (const auto observation = observations.next()) {
    const auto* comment = dynamic_cast<const mrpt::obs::CObservationComment*>(observation.get());
    if (comment && formatOfComment(comment->text) == kRunFormat)
      return runRecordFromJson(comment->text, path);
  }
  throw DataError(path, 0,
                  "expected a comment of the format \"" + std::string(kRunFormat) +
                      "\" in the log of a run, found none to its end");
}

}  // namespace etalon
