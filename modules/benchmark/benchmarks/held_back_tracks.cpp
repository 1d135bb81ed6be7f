// held_back_tracks SRC [--from S] [--to S] [--every S] [--tracks FOLDER] [--initializer NAME]
//                  [-c INI] [--set section.key=value]...
//
// Does VI-BA predict pixels that it did not see? SRC is a recording (EuRoC folder or
// .rawlog), from S to S after its first image. In every window stereo odometry, initializer and
// VI-BA get the tracks of even number alone; the poses of each then predict the pixels of the odd
// ones (prediction_error.h: a landmark from its other keyframes, at least two); then the halves
// swap. All pose sets are judged on the same pixels: those that all predict, less those that all
// miss by more than 3 px. The ground truth's poses, where there are some, are judged beside them.
// Prints, by pose set, means over the windows: RMS of a pixel coordinate's error, median of the
// pixel's distance, and by how much the RMS after VI-BA is larger, with the 95 % interval of a
// bootstrap in blocks of overlapping windows (paired_bootstrap.h). --tracks keeps the tracks in
// FOLDER.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>

#include "cut_tracks.h"
#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/paired_bootstrap.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/testing/program.h"
#include "prediction_error.h"

namespace {

using namespace etalon;

constexpr double kSigmaPx = 0.4;  // of a held-back pixel: robust beyond three of them
constexpr double kGrossPx = 3.0;

enum PoseSet : size_t { kOdometry, kBefore, kAfter, kTruth, kSets };
constexpr std::array<const char*, kSets> kNames = {"stereo odometry", "before VI-BA", "after VI-BA",
                                                   "ground truth"};

struct Arguments {
  std::string source, tracks, initializer = "eta";
  double from_s = 0.0, to_s = 1e9, every_s = 0.5;
  IniFile ini;
};

/** Of one window, or of one half of it. */
struct Score {
  std::array<double, kSets> rms_px{}, median_px{};
  size_t pixels = 0;
  bool accepted = true;
};

std::vector<TrackedFrame> halfOf(std::vector<TrackedFrame> frames, LandmarkId half) {
  for (TrackedFrame& frame : frames)
    frame.observations.erase(
        std::remove_if(frame.observations.begin(), frame.observations.end(),
                       [half](const Observation& o) { return o.id % 2 != half; }),
        frame.observations.end());
  return frames;
}

/** Poses of the problem's keyframes by every method; nothing if the initializer refuses. */
std::optional<std::array<std::vector<SE3>, kSets>> posesOf(const InitializationProblem& problem,
                                                           const Initializer& initializer,
                                                           const WindowOptions& options,
                                                           const GroundTruth& truth,
                                                           bool* accepted) {
  const InitializationAttempt attempt = attemptInitialization(problem, initializer, options);
  if (!attempt.has_vi_ba) return std::nullopt;
  *accepted = attempt.accepted();
  std::array<std::vector<SE3>, kSets> poses;
  poses[kOdometry] = problem.visualSolution()->T_VB;
  for (const StampedState& state : attempt.init->states) poses[kBefore].push_back(state.T_WB);
  poses[kAfter] = attempt.poses();
  for (const TrackedFrame* frame : problem.keyframes())
    if (const auto state = truth.at(frame->t)) poses[kTruth].push_back(state->T_WB);
  if (poses[kTruth].size() < poses[kAfter].size()) poses[kTruth].clear();
  return poses;
}

/** How well the poses predict what `held_back` sees. */
Score judge(const VisualWindow& held_back, const std::array<std::vector<SE3>, kSets>& poses) {
  std::array<std::vector<double>, kSets> errors, kept;
  for (size_t s = 0; s < kSets; ++s)
    if (!poses[s].empty()) errors[s] = predictionErrors(held_back, kSigmaPx, poses[s]);
  for (size_t i = 0; i < held_back.measurements.size(); ++i) {
    bool predicted = true, gross = true;
    for (size_t s = 0; s < kSets; ++s) {
      if (poses[s].empty()) continue;
      predicted = predicted && !std::isnan(errors[s][i]);
      gross = gross && (s == kTruth || errors[s][i] > kGrossPx);
    }
    if (!predicted || gross) continue;
    for (size_t s = 0; s < kSets; ++s)
      if (!poses[s].empty()) kept[s].push_back(errors[s][i]);
  }
  Score score;
  score.pixels = kept[kAfter].size();
  for (size_t s = 0; s < kSets; ++s) {
    double sum = 0.0;
    for (const double e : kept[s]) sum += e * e;
    score.rms_px[s] = std::sqrt(sum / (2.0 * static_cast<double>(kept[s].size())));
    score.median_px[s] = median(kept[s]);
  }
  return score;
}

/** The mean of both halves; nothing if the initializer refuses one. */
std::optional<Score> judgeWindow(const InitializationProblem& whole, const GroundTruth& truth,
                                 const Initializer& initializer, const WindowOptions& options) {
  Score score;
  for (const LandmarkId half : {0, 1}) {
    const InitializationProblem seen =
        makeProblem(whole.calibration(), whole.imuNoise(), options, halfOf(whole.frames(), half),
                    whole.keyframeIndices(), whole.imu());
    bool accepted = false;
    const auto poses = posesOf(seen, initializer, options, truth, &accepted);
    if (!poses) return std::nullopt;
    const std::vector<TrackedFrame> others = halfOf(whole.frames(), 1 - half);
    std::vector<const TrackedFrame*> keyframes;
    for (const int index : whole.keyframeIndices()) keyframes.push_back(&others[index]);
    const Score part = judge(buildVisualWindow(whole.calibration(), keyframes, kSigmaPx), *poses);
    if (part.pixels == 0) return std::nullopt;
    for (size_t s = 0; s < kSets; ++s) {
      score.rms_px[s] += 0.5 * part.rms_px[s];
      score.median_px[s] += 0.5 * part.median_px[s];
    }
    score.pixels += part.pixels;
    score.accepted = score.accepted && accepted;
  }
  return score;
}

void print(const std::vector<Score>& scores, int windows, size_t block) {
  size_t pixels = 0, accepted = 0;
  for (const Score& score : scores) {
    pixels += score.pixels;
    accepted += score.accepted ? 1 : 0;
  }
  std::printf("%zu windows of %d, in %zu VI-BA of both halves is accepted; %zu held-back pixels\n",
              scores.size(), windows, accepted, pixels);
  std::printf("poses           | rms px | median px | after VI-BA less this, rms px [95 %%]\n");
  for (size_t s = 0; s < kSets; ++s) {
    PairedCluster pairs;
    double rms = 0.0, median_px = 0.0;
    for (const Score& score : scores) {
      if (std::isnan(score.rms_px[s])) continue;  // the truth does not cover it
      rms += score.rms_px[s];
      median_px += score.median_px[s];
      pairs.a.push_back(score.rms_px[kAfter]);
      pairs.b.push_back(score.rms_px[s]);
    }
    if (pairs.b.empty()) continue;
    const auto n = static_cast<double>(pairs.b.size());
    std::printf("%-15s | %.4f |    %.4f |", kNames[s], rms / n, median_px / n);
    pairs.block = std::min(block, pairs.b.size());
    const BootstrapInterval interval = pairedBootstrap({pairs}, PairedStatistic::kMean);
    if (s == kAfter)
      std::printf("\n");
    else
      std::printf(" %+.4f [%+.4f, %+.4f]\n", interval.difference, interval.low, interval.high);
  }
}

void run(const Arguments& arguments) {
  const SuiteConfiguration suite =
      loadSuiteConfiguration(arguments.ini, {}, {arguments.initializer});
  const PipelineOptions& pipeline = suite.pipeline;
  const auto recording = openRecording(arguments.source);
  TrackingOptions tracking;
  tracking.frontend = pipeline.frontend;
  tracking.gyro_bias = pipeline.window.priors.mean.gyro;
  SequenceTracks tracks =
      arguments.tracks.empty()
          ? trackSequence(*recording, tracking)
          : loadOrTrack(*recording, recordingHash(*recording), recordingName(arguments.source),
                        arguments.tracks, tracking, nullptr);
  cutTracks(arguments.from_s, arguments.to_s, &tracks);
  if (tracks.frames.empty()) throw ConfigError("no image between --from and --to");
  const WindowShape shape{pipeline.keyframes, pipeline.keyframe_rate_hz};
  const int windows =
      windowCount(tracks.first_image, tracks.frames.back().t, arguments.every_s, shape);
  std::vector<Score> scores;
  for (int window = 0; window < windows; ++window) {
    const auto score =
        judgeWindow(windowProblem(tracks, arguments.every_s, shape, window, pipeline.imu_noise,
                                  pipeline.window),
                    tracks.ground_truth, *suite.initializers[0].initializer, pipeline.window);
    if (score) scores.push_back(*score);
  }
  if (scores.empty())
    throw DataError(arguments.source, 0,
                    "none of " + std::to_string(windows) + " windows could be judged");
  const double overlapping = (shape.keyframes - 1) / shape.rate_hz / arguments.every_s;
  print(scores, windows, static_cast<size_t>(std::ceil(overlapping)));
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  Arguments arguments;
  testing::IniOptions ini;
  CLI::App app("Judges an initializer's windows by tracks that were held back", "held_back_tracks");
  app.add_option("SRC", arguments.source, "EuRoC folder or .rawlog")->required();
  app.add_option("--from", arguments.from_s, "Start, seconds after the first image");
  app.add_option("--to", arguments.to_s, "End, seconds after the first image");
  app.add_option("--every", arguments.every_s, "Seconds from window to window")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--tracks", arguments.tracks, "Folder of the cached tracks");
  app.add_option("--initializer", arguments.initializer, "Plugin")->capture_default_str();
  ini.addTo(&app);
  return testing::runProgram(&app, argc, argv, [&] {
    arguments.ini = ini.ini();
    run(arguments);
  });
}
