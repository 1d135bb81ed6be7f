#include "etalon/report/run_results.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>

#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/core/trajectory.h"
#include "etalon/datasets/sensor_yaml_text.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/report/plot.h"
#include "etalon/report/report.h"
#include "etalon/report/scene.h"
#include "etalon/runlog/attempt_record.h"
#include "etalon/runlog/states_csv.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

constexpr char kTumFramesNeverInitialized[] =
    "T_VB, never initialized: V is the body's frame at the first image, not aligned with gravity";

constexpr char kJsonName[] = "initialization.json";
// Files that not every run has.
constexpr char kFinalTrajectory[] = "trajectory_final.tum";
constexpr char kImuStates[] = "states_imu.csv";
constexpr std::array kProposedCalibration = {"proposed_cam0.yaml", "proposed_cam1.yaml"};

/** Of the frames that the stage worked on. */
StageTimes timesOf(const std::string& stage, const std::vector<FrameTiming>& timings,
                   double FrameTiming::*member) {
  StageTimes times;
  times.stage = stage;
  std::vector<double> ms;
  for (const FrameTiming& t : timings) {
    if (!(t.*member > 0.0)) continue;
    ms.push_back(t.*member);
    times.max_ms = std::max(times.max_ms, t.*member);
    times.total_s += 1e-3 * t.*member;
  }
  times.frames = ms.size();
  times.median_ms = quantile(ms, 0.5);
  times.p99_ms = quantile(std::move(ms), 0.99);
  return times;
}

RunStatistics statisticsOf(const FinishedRun& run) {
  RunStatistics s;
  const ReadStatistics& read = run.source.statistics();
  s.stereo_frames = read.stereo_frames;
  s.imu_samples = read.imu_samples;
  s.unpaired_left = read.unpaired_left;
  s.unpaired_right = read.unpaired_right;
  s.unreadable_images = read.unreadable_images;
  s.frames_not_located = run.pipeline.framesNotLocated();
  for (const auto& [fault, c] : run.pipeline.inputFaults())
    s.input_faults.push_back({toString(fault), c.count, c.first, c.value});
  if (!run.images.empty()) s.duration_s = secondsBetween(run.images.front().t, run.images.back().t);
  s.wall_s = run.wall_s;
  std::vector<double> frame_ms;
  for (const FrameTiming& t : run.pipeline.timings())
    frame_ms.push_back(t.frontend_ms + t.odometry_ms);
  s.frame_median_ms = median(frame_ms);
  const std::vector<FrameTiming>& timings = run.pipeline.timings();
  s.stages = {timesOf("front_end", timings, &FrameTiming::frontend_ms),
              timesOf("odometry", timings, &FrameTiming::odometry_ms),
              timesOf("initialization", timings, &FrameTiming::initialization_ms)};
  return s;
}

EventRecord recordOf(const PipelineEvent& event) {
  EventRecord record{event.t, toString(event.state), event.reason, event.remark, {}};
  if (!event.jump) return record;
  const Eigen::Matrix<double, 6, 1> variance = event.jump->covariance.diagonal().cwiseMax(0.0);
  record.jump = {event.jump->T_before_after.t.norm(),
                 degrees(logSO3(event.jump->T_before_after.R).norm()),
                 std::sqrt(variance.tail<3>().sum()), degrees(std::sqrt(variance.head<3>().sum()))};
  return record;
}

CalibrationRecord recordOf(const CalibrationFinding& finding) {
  const auto numbers = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.data(), v.data() + v.size());
  };
  return {finding.group, finding.quantity,       finding.unit,           toString(finding.verdict),
          finding.words, numbers(finding.value), numbers(finding.sigma), numbers(finding.used)};
}

/** Whether the odometry used other cameras than it was given. */
bool hasProposal(const FinishedRun& run) {
  const StereoInertialCalibration used = run.pipeline.calibrationInUse();
  const StereoInertialCalibration& given = run.source.calibration();
  for (size_t c = 0; c < 2; ++c)
    if (used.cameras[c].model != given.cameras[c].model ||
        used.cameras[c].T_BC.matrix() != given.cameras[c].T_BC.matrix())
      return true;
  return false;
}

/** The reader's warnings, then what the pipeline found in its input. Both know of frames outside
 * the IMU's time. */
std::vector<std::string> warningsOf(const FinishedRun& run) {
  const ReadStatistics& read = run.source.statistics();
  std::vector<std::string> warnings = read.warnings;
  for (const auto& [fault, count] : run.pipeline.inputFaults())
    if (fault != InputFault::kFrameWithoutImu || count.count > read.outside_imu)
      warnings.push_back(describe(fault, count));
  return warnings;
}

FinalBaRecord recordOf(const TrajectoryBaResult& ba, double wall_s) {
  FinalBaRecord record;
  record.keyframes = ba.bundle.window.keyframe_count;
  record.landmarks = ba.bundle.window.landmarkCount();
  record.pixels = ba.bundle.window.measurements.size();
  record.inlier_pixels = ba.bundle.inlierCount();
  record.noise_factor = ba.noise_factor;
  record.iterations = ba.summary.iterations;
  record.termination = toString(ba.summary.termination);
  record.wall_s = wall_s;
  return record;
}

/** Before initialization the odometry's frame is not aligned with gravity, so yaw alone cannot
 * align it. */
AlignmentType rotationAlignment(const RunRecord& record) {
  return record.initialized_at ? AlignmentType::kYawPosition : AlignmentType::kSE3;
}

/** Positions are aligned in SE(3), the usual ATE. On a short path this hardly determines the
 * rotation, so rotations are aligned as in the picture. */
TrajectoryErrors trajectoryErrorsOf(const RunRecord& record, const Trajectory& trajectory,
                                    const GroundTruth& truth) {
  const AssociatedTrajectories both = associate(trajectory, truth);
  TrajectoryErrors errors = absoluteErrors(both, AlignmentType::kSE3);
  if (record.initialized_at)
    errors.rotation_deg = absoluteErrors(both, rotationAlignment(record)).rotation_deg;
  return errors;
}

/** Writes the files of a run, each for itself, and puts them in place together. */
class ResultWriter {
 public:
  explicit ResultWriter(const std::string& folder)
      : folder_(folder), after_a_run_(fs::exists(folder_ / kJsonName)), output_(folder) {}

  /** @param content writes the file to a path */
  void write(const std::string& name, const std::function<void(const std::string&)>& content) {
    const std::string path = output_.path(name);
    try {
      if (fs::is_directory(folder_ / name))
        throw DataError((folder_ / name).string(), 0, "cannot be written: a folder has this name");
      content(path);
      files_.written.push_back((folder_ / name).string());
    } catch (const DataError& e) {
      std::error_code ignored;
      fs::remove(path, ignored);
      std::string reason = e.what();  // names the file where it is written until it is whole
      if (reason.compare(0, path.size(), path) == 0)
        reason.replace(0, path.size(), (folder_ / name).string());
      files_.failures.push_back(reason);
    }
  }

  RunFiles finish() {
    output_.putInPlace();
    if (after_a_run_) removeFormer();
    return std::move(files_);
  }

 private:
  /** Of an earlier run in the folder those files that this one has not, or could not write. */
  void removeFormer() const {
    for (const std::string name :
         {"trajectory.tum", "trajectory_smoothed.tum", kFinalTrajectory, "states.csv", kJsonName,
          "trajectory.png", "report.html", "flight.3Dscene", kImuStates, kProposedCalibration[0],
          kProposedCalibration[1], "config.ini", kRunLogName}) {
      const std::string file = (folder_ / name).string();
      std::error_code ignored;
      if (fs::is_regular_file(file, ignored) &&
          std::find(files_.written.begin(), files_.written.end(), file) == files_.written.end())
        fs::remove(file, ignored);
    }
  }

  fs::path folder_;
  bool after_a_run_;  ///< whether the folder holds an earlier run
  OutputFiles output_;
  RunFiles files_;
};

FlightScene sceneOf(const FinishedRun& run, const Trajectory& smoothed) {
  FlightScene scene;
  scene.keyframes = run.pipeline.record().smoothed();
  scene.landmarks = run.pipeline.record().landmarks();
  scene.trajectory = smoothed;
  if (!run.final_flight) return scene;
  scene.keyframes = run.final_flight->keyframes;
  scene.trajectory = carriedAlong(smoothed, scene.keyframes);
  for (const auto& [id, p_W] : run.final_flight->ba.bundle.validLandmarks())
    scene.landmarks[id] = p_W;
  return scene;
}

}  // namespace

RunRecord makeRunRecord(const FinishedRun& run) {
  RunRecord record;
  record.source = std::filesystem::absolute(run.source.name()).lexically_normal().string();
  record.source_kind = run.source.kind();
  record.initializer = run.configuration.plugin.name;
  record.initializer_version = run.configuration.plugin.version;
  record.initializer_path = run.configuration.plugin.path;
  if (const auto& at_rest = run.configuration.at_rest_plugin) {
    record.at_rest_initializer = at_rest->name;
    record.at_rest_initializer_version = at_rest->version;
    record.at_rest_initializer_path = at_rest->path;
  }
  record.versions = run.versions;
  record.config = run.configuration.effective_ini;
  if (!run.images.empty()) record.first_image = run.images.front().t;
  record.initialized_at = run.pipeline.initializedAt();
  record.handed_over_at = run.pipeline.handedOverAt();
  const GroundTruth& ground_truth = run.source.groundTruth();
  for (const InitializationAttempt& attempt : run.pipeline.attempts())
    record.attempts.push_back(
        makeAttemptRecord(attempt, run.configuration.pipeline.window.gravity_mps2, ground_truth));
  for (const PipelineEvent& event : run.pipeline.events()) record.events.push_back(recordOf(event));
  for (const CalibrationFinding& finding : run.pipeline.calibrationFindings())
    record.calibration.push_back(recordOf(finding));
  record.statistics = statisticsOf(run);
  record.warnings = warningsOf(run);
  if (run.final_flight) record.final_ba = recordOf(run.final_flight->ba, run.final_ba_s);
  const Trajectory trajectory = run.pipeline.trajectory();
  if (ground_truth.empty() || trajectory.empty()) return record;
  record.ground_truth = GroundTruthUse{static_cast<int>(trajectory.size()),
                                       static_cast<int>(coveredPoses(trajectory, ground_truth))};
  record.trajectory_errors = trajectoryErrorsOf(record, trajectory, ground_truth);
  const Trajectory smoothed = run.pipeline.smoothedTrajectory();
  record.smoothed_errors = trajectoryErrorsOf(record, smoothed, ground_truth);
  if (run.final_flight)
    record.final_errors = trajectoryErrorsOf(
        record, carriedAlong(smoothed, run.final_flight->keyframes), ground_truth);
  requireCoverage(&record, run.min_coverage);
  if (!record.trajectory_errors)
    record.warnings.push_back(describeCoverage(*record.ground_truth, run.min_coverage));
  return record;
}

RunFiles writeRunResults(const std::string& folder, const FinishedRun& run,
                         const RunRecord& record) {
  ResultWriter results(folder);
  const Trajectory trajectory = run.pipeline.trajectory();
  const std::string frames = record.initialized_at ? "T_WB" : kTumFramesNeverInitialized;
  const Trajectory smoothed = run.pipeline.smoothedTrajectory();
  const auto write = [&](const char* name, const auto& content) { results.write(name, content); };
  write("trajectory.tum", [&](const std::string& path) { writeTum(path, trajectory, frames); });
  write("trajectory_smoothed.tum",
        [&](const std::string& path) { writeTum(path, smoothed, frames); });
  if (run.final_flight)
    write(kFinalTrajectory, [&](const std::string& path) {
      writeTum(path, carriedAlong(smoothed, run.final_flight->keyframes), frames);
    });
  write("states.csv",
        [&](const std::string& path) { writeStatesCsv(path, run.pipeline.estimates()); });
  write(kJsonName, [&](const std::string& path) { writeInitializationJson(path, record); });
  write("trajectory.png", [&](const std::string& path) {
    TrajectoryPlotOptions plot;
    plot.title =
        std::filesystem::path(record.source).filename().string() + ", " + record.initializer;
    plot.initialized_at = record.initialized_at;
    plot.alignment = rotationAlignment(record);
    drawTrajectoryPlot(path, trajectory, run.source.groundTruth(), plot);
  });
  write("report.html", [&](const std::string& path) {
    writeFile(path, runReportHtml(record, run.pipeline.estimates(), run.source.groundTruth()));
  });
  write("flight.3Dscene",
        [&](const std::string& path) { writeScene(path, sceneOf(run, smoothed)); });
  if (!run.imu_states.empty())
    write(kImuStates, [&](const std::string& path) { writeImuStatesCsv(path, run.imu_states); });
  const bool proposal = hasProposal(run);
  for (size_t c = 0; proposal && c < 2; ++c)
    write(kProposedCalibration[c], [&](const std::string& path) {
      writeFile(path, cameraYaml(run.pipeline.calibrationInUse().cameras[c],
                                 "as the odometry corrected it"));
    });
  write("config.ini",
        [&](const std::string& path) { writeFile(path, run.configuration.effective_ini); });
  // The largest comes last: it takes no room from the others.
  write(kRunLogName, [&](const std::string& path) {
    writeRunLog(path, {record, run.source.calibration(), run.images, run.pipeline.estimates(),
                       run.source.groundTruth()});
  });
  return results.finish();
}

}  // namespace etalon
