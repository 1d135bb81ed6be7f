#include "etalon/runlog/run_log.h"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <filesystem>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recording_comment.h"

namespace etalon {
namespace {

using mrpt::obs::CObservation;

/** The attempt whose keyframes go into the log; null if none has states. */
const AttemptRecord* attemptToLog(const RunRecord& record) {
  if (const AttemptRecord* accepted = record.acceptedAttempt()) return accepted;
  for (auto attempt = record.attempts.rbegin(); attempt != record.attempts.rend(); ++attempt)
    if (!attempt->stages.empty()) return &*attempt;
  return nullptr;
}

std::vector<CObservation::Ptr> observationsOf(const RunLog& log) {
  std::vector<CObservation::Ptr> observations;
  const auto add = [&observations](const StampedPose& pose, const std::string& label) {
    observations.push_back(
        std::make_shared<mrpt::obs::CObservationRobotPose>(toObservation(pose, label)));
  };
  for (const StereoReference& image : log.images) {
    if (image.left_path.empty() || image.right_path.empty()) continue;
    StereoFrame frame;
    frame.t = image.t;
    frame.left_path = image.left_path;
    frame.right_path = image.right_path;
    observations.push_back(std::make_shared<mrpt::obs::CObservationStereoImages>(
        toObservation(frame, log.calibration, true)));
  }
  if (const AttemptRecord* attempt = attemptToLog(log.record))
    for (const StageRecord& stage : attempt->stages)
      for (const StampedState& state : stage.states)
        add({state.t, state.T_WB}, log.record.initializer + "/" + stage.stage);
  for (const FrameEstimate& estimate : log.estimates)
    observations.push_back(std::make_shared<mrpt::obs::CObservationRobotPose>(
        toObservation({estimate.t, estimate.nav.T_WB}, log.record.initializer + "/odometry",
                      estimate.pose_covariance)));
  if (!log.estimates.empty())
    for (const StampedState& state : log.ground_truth.states)
      if (state.t >= log.estimates.front().t && state.t <= log.estimates.back().t)
        add({state.t, state.T_WB}, kGroundTruthLabel);
  std::stable_sort(observations.begin(), observations.end(),
                   [](const auto& a, const auto& b) { return a->timestamp < b->timestamp; });
  return observations;
}

}  // namespace

void writeRunLog(const std::string& path, const RunLog& log) {
  const std::vector<CObservation::Ptr> observations = observationsOf(log);
  RawlogWriter writer(path);
  const TimeNs first =
      observations.empty() ? log.record.first_image : fromMrptTime(observations.front()->timestamp);
  writer.write(commentObservation(first, toJson(log.record)));
  for (const CObservation::Ptr& observation : observations) writer.write(*observation);
  writer.close();
}

RunRecord readRunRecord(const std::string& run) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string path =
      fs::is_directory(run, ignored) ? (fs::path(run) / kRunLogName).string() : run;
  if (!fs::is_regular_file(path, ignored))
    throw DataError(path, 0, "there is no such file; expected the log of a run (etalon replay)");
  mrpt::io::CFileGZInputStream stream;
  if (!stream.open(path)) throw DataError(path, 0, "cannot be opened; expected an MRPT rawlog");
  auto archive = mrpt::serialization::archiveFrom(stream);
  for (;;) {
    mrpt::serialization::CSerializable::Ptr object;
    try {
      object = archive.ReadObject();
    } catch (const std::exception&) {  // the end of the log, or an unreadable object
      throw DataError(path, 0,
                      "expected an MRPT rawlog with a comment of the format \"" +
                          std::string(kRunFormat) + "\", found none to its end");
    }
    const auto comment = std::dynamic_pointer_cast<mrpt::obs::CObservationComment>(object);
    if (comment && formatOfComment(comment->text) == kRunFormat)
      return runRecordFromJson(comment->text, path);
  }
}

}  // namespace etalon
