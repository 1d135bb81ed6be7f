// odometry_accuracy SRC [options]; --help lists them.
//
// Measures the odometry without the front end. SRC is a recording with ground truth. Its tracks
// come from the front end or from a cache. Both odometries run from --from to the end, from the
// ground truth's state with errors as a good initialization has them. The map finds old keyframes in
// the recording's images. --wrong NAME=NUMBER: the odometry is given a calibration that is wrong by
// so much (WrongCalibration: time_offset, camera_rotation, stereo_rotation, baseline, focal, radial,
// radial_k3); prints what it says of it.
//
// Prints a line for each odometry: ATE after alignment in SE(3), and in yaw and position alone; RPE
// over 100 frames; RMSE of roll and pitch from 10 s after the start on, against the ground truth
// and against the ground truth turned to where the recording's accelerometer has gravity; RMSE of
// the velocity; scale; CPU time of a frame; mean NEES per degree of freedom of the fixed-lag
// odometry's rotation, position, velocity, b_g and b_a.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/core/utility.hpp>
#include <random>
#include <string>

#include "cut_tracks.h"
#include "etalon/benchmark/calibration/flight_over_tracks.h"
#include "etalon/benchmark/content_hash.h"
#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/evaluation/ground_truth_check.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/odometry/flight_record.h"
#include "etalon/odometry/stereo_visual_odometry.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/testing/program.h"
#include "etalon/testing/wrong_calibration.h"
#include "recorded_views.h"

namespace {

using namespace etalon;
using Eigen::Vector3d;

struct Arguments {
  std::string source, tracks;
  std::vector<std::string> wrong;
  bool stereo = true, map = false, final_ba = false;
  double from_s = 0.0;
  IniFile ini;
};

/** A state for every frame. */
struct Run {
  std::string name;
  std::vector<OdometryOutput> outputs;
  std::vector<double> ms;
  int keyframes = 0;
};

SequenceTracks load(const Arguments& arguments, const PipelineOptions& pipeline) {
  const auto recording = openRecording(arguments.source);
  const TrackingOptions tracking = trackingOptions(pipeline);
  SequenceTracks tracks =
      arguments.tracks.empty()
          ? trackSequence(*recording, tracking)
          : loadOrTrack(*recording, recordingHash(*recording), recordingName(arguments.source),
                        arguments.tracks, tracking, nullptr);
  cutTracks(arguments.from_s, 1e9, &tracks);
  return tracks;
}

/** The tracks as they are with a calibration that is wrong. */
void makeWrong(const std::vector<std::string>& arguments, SequenceTracks* tracks) {
  testing::WrongCalibration wrong;
  for (const std::string& argument : arguments) {
    const size_t equals = argument.find('=');
    const auto numbers = wrong.numbers();
    const auto number = numbers.find(argument.substr(0, equals));
    if (number == numbers.end() || equals == std::string::npos)
      throw ConfigError(
          "--wrong " + argument +
          ": expected time_offset, camera_rotation, stereo_rotation, baseline, focal, "
          "radial or radial_k3, '=' and a number");
    *number->second = std::stod(argument.substr(equals + 1));
  }
  tracks->calibration = wrong.given(tracks->calibration);
  const auto earlier = static_cast<TimeNs>(std::llround(1e6 * wrong.time_offset));
  for (TrackedFrame& frame : tracks->frames) frame.t -= earlier;
}

/** The first frame with ground truth: its state, with errors as a good initialization has them. */
TracksStart fromTruth(const SequenceTracks& tracks) {
  TracksStart beginning;
  while (beginning.frame < tracks.frames.size() &&
         !tracks.ground_truth.at(tracks.frames[beginning.frame].t))
    ++beginning.frame;
  if (beginning.frame == tracks.frames.size()) throw ConfigError("no ground truth for any frame");
  const StampedState truth = *tracks.ground_truth.at(tracks.frames[beginning.frame].t);
  Eigen::Matrix<double, 15, 1> sigma;
  sigma << Vector3d::Constant(0.005), Vector3d::Constant(1e-4), Vector3d::Constant(0.02),
      Vector3d::Constant(0.003), Vector3d::Constant(0.05);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 15, 1> error;
  for (int i = 0; i < 15; ++i) error[i] = sigma[i] * normal(generator);
  beginning.start.state = truth.plus(error);
  beginning.start.covariance = sigma.cwiseAbs2().asDiagonal();
  return beginning;
}

/** @param views of the odometry; null: none @param record null: none */
Run fly(const std::string& name, const SequenceTracks& tracks, const TracksStart& beginning,
        Odometry* odometry, RecordedViews* views, FlightRecord* record) {
  Run run;
  run.name = name;
  for (size_t i = beginning.frame; i < tracks.frames.size(); ++i) {
    const TrackedFrame& frame = tracks.frames[i];
    std::vector<ImuSample> imu;
    if (i > beginning.frame) imu = tracks.imu.between(tracks.frames[i - 1].t, frame.t);
    if (views) views->at(frame.t);
    const double before = cpuMilliseconds();
    run.outputs.push_back(i == beginning.frame ? odometry->start(beginning.start, frame)
                                               : odometry->process(frame, imu));
    run.ms.push_back(cpuMilliseconds() - before);
    if (views) run.ms.back() -= views->takeReadingMilliseconds();
    run.keyframes += run.outputs.back().keyframe;
    if (record) record->add(frame.t, frame, imu, run.outputs.back(), odometry);
  }
  for (const CalibrationFinding& finding : odometry->calibrationFindings())
    std::printf("%s\n", finding.words.c_str());
  return run;
}

/** The run with hindsight: every keyframe has its last estimate, and the frames between follow. */
Run withHindsight(const Run& causal, const std::string& name, const Trajectory& keyframes) {
  Run run = causal;
  run.name = name;
  Trajectory trajectory;
  for (const OdometryOutput& out : causal.outputs) trajectory.push_back({out.t, out.state.T_WB});
  trajectory = carriedAlong(trajectory, keyframes);
  for (size_t i = 0; i < trajectory.size(); ++i) run.outputs[i].state.T_WB = trajectory[i].T_WB;
  return run;
}

FinalFlight finalBa(const FlightRecord& record, const BiasPriors& priors) {
  const double before = cpuMilliseconds();
  FinalFlight flight = record.finalBa(priors);
  const TrajectoryBaResult& ba = flight.ba;
  std::printf(
      "final BA: %zu keyframes, %d landmarks, %zu pixels (%d inliers), %.2f of sigma_px, "
      "%d iterations (%s), %.1f s\n",
      flight.keyframes.size(), ba.bundle.window.landmarkCount(),
      ba.bundle.window.measurements.size(), ba.bundle.inlierCount(), ba.noise_factor,
      ba.summary.iterations, toString(ba.summary.termination), 1e-3 * (cpuMilliseconds() - before));
  return flight;
}

double rms(const std::vector<double>& squares) {
  double sum = 0.0;
  for (const double s : squares) sum += s;
  return std::sqrt(sum / static_cast<double>(squares.size()));
}

void printRun(const Run& run, const SequenceTracks& tracks, const Vector3d& down_G) {
  const GroundTruth& truth = tracks.ground_truth;
  Trajectory trajectory;
  for (const OdometryOutput& out : run.outputs) trajectory.push_back({out.t, out.state.T_WB});
  const AssociatedTrajectories both = associate(trajectory, truth);
  const double ate = absoluteErrors(both, AlignmentType::kSE3).position_m.rmse;
  const double ate_yaw = absoluteErrors(both, AlignmentType::kYawPosition).position_m.rmse;
  const double scale = alignmentOf(both, AlignmentType::kSim3)->scale;
  const TrajectoryErrors relative = relativeErrors(both, {100, DeltaUnit::kFrames});
  std::vector<double> tilt, tilt_corrected, velocity;
  Eigen::Matrix<double, 5, 1> nees = Eigen::Matrix<double, 5, 1>::Zero();
  int with_truth = 0;
  for (const OdometryOutput& out : run.outputs) {
    const auto at = truth.at(out.t);
    if (!at) continue;
    const Vector3d down_B = out.state.T_WB.R.transpose() * -Vector3d::UnitZ();
    const Eigen::Matrix3d R_BG = at->T_WB.R.transpose();
    if (secondsBetween(run.outputs.front().t, out.t) > 10.0) {
      tilt.push_back(std::pow(angleBetween(down_B, R_BG * -Vector3d::UnitZ()), 2));
      tilt_corrected.push_back(std::pow(angleBetween(down_B, R_BG * down_G), 2));
    }
    velocity.push_back(
        (out.state.T_WB.R.transpose() * out.state.v_WB - R_BG * at->v_WB).squaredNorm());
    const Eigen::Matrix<double, 15, 1> d = out.state.minus({at->T_WB, at->v_WB, at->bias});
    for (int b = 0; b < 5; ++b)
      nees[b] += d.segment<3>(3 * b).dot(out.covariance.block<3, 3>(3 * b, 3 * b).inverse() *
                                         d.segment<3>(3 * b)) /
                 3.0;
    ++with_truth;
  }
  nees /= with_truth;
  double used = 0.0, seen = 0.0;
  const auto frames = static_cast<double>(run.outputs.size());
  for (const OdometryOutput& out : run.outputs) {
    used += out.used;
    seen += out.observations;
  }
  std::vector<double> ms = run.ms;
  std::printf(
      "%-9s | %.4f | %.4f | %.4f | %.4f | %.3f | %.3f | %.4f | %+.2f | %.2f / %.2f | %4d | %.0f / "
      "%.0f | "
      "%.2f %.2f %.2f %.2f %.2f\n",
      run.name.c_str(), ate, ate_yaw, relative.position_m.rmse, relative.rotation_deg.rmse,
      degrees(rms(tilt)), degrees(rms(tilt_corrected)), rms(velocity), 100.0 * (1.0 / scale - 1.0),
      quantile(ms, 0.5), quantile(ms, 0.99), run.keyframes, used / frames, seen / frames, nees[0],
      nees[1], nees[2], nees[3], nees[4]);
}

void run(const Arguments& arguments) {
  const SuiteConfiguration suite = loadSuiteConfiguration(arguments.ini, {}, {"eta"});
  SequenceTracks tracks = load(arguments, suite.pipeline);
  makeWrong(arguments.wrong, &tracks);
  if (tracks.frames.empty()) throw ConfigError("no image after --from");
  const GroundTruthCheck check = checkGroundTruth(tracks.ground_truth, tracks.imu.samples());
  const TracksStart beginning = fromTruth(tracks);
  const FixedLagOptions options = suite.pipeline.fixedLag(tracks.calibration.imu.noise);
  std::printf("%s, %.1f s from frame %zu\n", recordingName(arguments.source).c_str(),
              secondsBetween(tracks.frames[beginning.frame].t, tracks.frames.back().t),
              beginning.frame);
  std::printf(
      "odometry  | ATE, m | yaw, m | 5 s, m | deg | tilt, deg | corrected | velocity, m/s | scale, "
      "%% | "
      "ms median / p99 | keyframes | used / seen | NEES R p v b_g b_a\n");
  FlightRecord record(tracks.calibration, {options.imu_noise, options.gravity_mps2,
                                           options.sigma_px, arguments.final_ba ? 100000U : 0U});
  const auto views = arguments.map ? std::make_shared<RecordedViews>(arguments.source) : nullptr;
  FixedLagOdometry odometry(tracks.calibration, options, suite.pipeline.map, views);
  const Run fixed_lag = fly("fixed lag", tracks, beginning, &odometry, views.get(), &record);
  const auto print = [&](const Run& each) { printRun(each, tracks, check.gravity_direction_G); };
  print(fixed_lag);
  const Run smoothed = withHindsight(fixed_lag, "smoothed", record.smoothed());
  print(smoothed);
  if (arguments.final_ba) {
    const FinalFlight flight = finalBa(record, suite.pipeline.window.priors);
    print(withHindsight(smoothed, "final", flight.keyframes));
  }
  if (arguments.stereo) {
    StereoVisualOdometry stereo(tracks.calibration, suite.pipeline.window.odometry,
                                {suite.pipeline.keyframe_rate_hz});
    print(fly("stereo", tracks, beginning, &stereo, nullptr, nullptr));
  }
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  Arguments arguments;
  testing::IniOptions ini;
  CLI::App app("Judges the odometries by a recording's ground truth", "odometry_accuracy");
  app.add_option("SRC", arguments.source, "EuRoC folder or .rawlog")->required();
  app.add_option("--tracks", arguments.tracks, "Folder of the cached tracks");
  app.add_option("--from", arguments.from_s, "Start, seconds after the first image");
  app.add_option("--wrong", arguments.wrong, "NAME=NUMBER: what is wrong with the calibration");
  app.add_option("--stereo", arguments.stereo, "Whether stereo odometry runs, too: yes or no")
      ->capture_default_str();
  app.add_option("--map", arguments.map, "Whether old keyframes are found again: yes or no")
      ->capture_default_str();
  app.add_option("--final-ba", arguments.final_ba, "Whether a BA of the flight follows: yes or no")
      ->capture_default_str();
  ini.addTo(&app);
  return testing::runProgram(&app, argc, argv, [&] {
    arguments.ini = ini.ini();
    run(arguments);
  });
}
