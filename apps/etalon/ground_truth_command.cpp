#include <Eigen/Geometry>
#include <cstdio>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "commands.h"
#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/vision_check.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/ground_truth/smoothing.h"
#include "etalon/report/ground_truth_report.h"
#include "options/ground_truth_option.h"
#include "options/recording_option.h"
#include "support/checks.h"
#include "support/progress_line.h"
#include "support/stop_on_signals.h"

namespace etalon::app {

namespace {

struct GroundTruthArguments {
  std::vector<std::string> sources;
  std::string out, images, tracks;
  bool no_images = false;
  GroundTruthOption recorded;
};

std::string csvOf(const GroundTruth& truth) {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
      "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
      "b_a_RS_S_z [m s^-2]\n";
  for (const StampedState& s : truth.states) {
    const Eigen::Quaterniond q(s.T_WB.R);
    text += format("%lld,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f",
                   static_cast<long long>(s.t), s.T_WB.t.x(), s.T_WB.t.y(), s.T_WB.t.z(), q.w(),
                   q.x(), q.y(), q.z(), s.v_WB.x(), s.v_WB.y(), s.v_WB.z());
    for (const Eigen::Vector3d& bias : {s.bias.gyro, s.bias.accel})
      text += format(",%.9f,%.9f,%.9f", bias.x(), bias.y(), bias.z());
    text += "\n";
  }
  return text;
}

/** The recording's images, tracked; no frames where it has none that can be used. */
SequenceTracks imagesOf(const std::string& source, const GroundTruthArguments& arguments,
                        ProgressLine* line) {
  const auto recording = openRecording(source);
  const std::string name = recordingName(source);
  TrackingOptions tracking;
  tracking.decode_ahead = true;
  tracking.progress = [&](size_t done, size_t total) {
    line->update(done == total, [&] {
      return format("ground-truth: %s: images %zu/%zu", name.c_str(), done, total);
    });
  };
  const std::string folder =
      arguments.tracks.empty() ? arguments.out + "/tracks" : arguments.tracks;
  std::string note;
  try {
    SequenceTracks tracks =
        loadOrTrack(*recording, recordingHash(*recording), name, folder, tracking, &note);
    line->interrupt();
    if (!note.empty()) std::fprintf(stderr, "note: %s\n", printable(note).c_str());
    return tracks;
  } catch (const DataError& e) {
    line->interrupt();
    std::fprintf(stderr, "warning: not checked by images: %s\n", printable(e.what()).c_str());
    return withoutTracks(*recording);
  }
}

GroundTruthJudgement judge(const std::string& source, const GroundTruthArguments& arguments) {
  SourceOptions options;
  options.ground_truth = arguments.recorded.of(source);
  const auto recording = openRecording(source, options);
  const GroundTruth& recorded = recording->groundTruth();
  if (recorded.empty()) throw DataError(source, 0, "has no ground truth");
  auto found =
      smoothGroundTruth(recorded, recording->imuMeasurements(), recording->calibration().imu.noise);
  if (!found) throw DataError(source, 0, "ground truth: " + found.error().reason);

  GroundTruthJudgement judgement{recordingName(source), std::move(*found), {}};
  const GroundTruth& corrected = judgement.found.corrected;
  const std::string folder = arguments.out + "/" + judgement.name;
  makeFolder(folder);
  if (!arguments.no_images) {
    ProgressLine line;
    judgement.vision = checkByVision(
        imagesOf(arguments.images.empty() ? source : arguments.images, arguments, &line), recorded,
        corrected);
  }
  Trajectory poses;
  for (const StampedState& state : corrected.states) poses.push_back({state.t, state.T_WB});
  writeFile(folder + "/data.csv", csvOf(corrected));
  writeTum(folder + "/corrected.tum", poses);
  writeFile(folder + "/report.html", groundTruthReportHtml(judgement, recorded));
  return judgement;
}

}  // namespace

void addGroundTruthCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<GroundTruthArguments>();
  CLI::App* command = app.add_subcommand(
      "ground-truth", "Smooth a recorded ground truth with the IMU and say what is wrong with it.");
  command->add_option("SRC", arguments->sources, kSourceFormats)->required();
  command->add_option("--out", arguments->out, "Folder for the corrected ones and the reports")
      ->check(checkOutputPath())
      ->required();
  arguments->recorded.add(command);
  CLI::Option* images = command->add_option(
      "--images", arguments->images,
      "Recording whose images check the result, in place of SRC's own (a part of the same flight)");
  command->add_flag("--no-images", arguments->no_images, "Do not look at images")->excludes(images);
  command->add_option("--tracks", arguments->tracks,
                      "Folder for the cached tracks of the front end (default: OUT/tracks)");
  command->footer(
      "Writes NAME/{data.csv, corrected.tum, report.html} into the folder.\n"
      "Exit codes: 0 done, 2 usage, 3 data (a recording could not be used; the others are done),\n"
      "130 interrupted.");
  command->callback([arguments, exit_code] {
    arguments->recorded.check(arguments->sources);
    if (!arguments->images.empty() && arguments->sources.size() > 1)
      throw ConfigError("--images belongs to one recording; expected a single SRC with it");
    cv::setNumThreads(1);
    endOnSignals("ground-truth: interrupted; recordings that were done are written");
    std::vector<GroundTruthJudgement> all;
    *exit_code = kOk;
    for (const std::string& source : arguments->sources) {
      try {
        all.push_back(judge(source, *arguments));
      } catch (const DataError& e) {
        std::fprintf(stderr, "error: %s\n", printable(e.what()).c_str());
        *exit_code = kDataErrorExit;
      }
    }
    if (!all.empty()) std::fputs(groundTruthPage(all).c_str(), stdout);
  });
}

}  // namespace etalon::app
