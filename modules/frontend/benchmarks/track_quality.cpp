// track_quality FOLDER [--refine N] [--set frontend.KEY=VALUE]...
//
// Judges the tracks of the stereo front end on a EuRoC folder with ground truth. Its poses are taken
// for exact; with --refine N they are the start of N rounds of refinement by the tracks, for real
// recordings. Prints, by the age of a track up to the 2.25 s of an initialization window:
//  - drift: the error of a left pixel if the landmark lies on the ray of the track's first left
//    pixel (its depth fitted), that is how far the track has wandered from the corner it began at;
//  - left, right: the reprojection errors of the landmark fitted to the whole track, as a bundle
//    adjustment sees them;
// then the shares of landmarks that keyframes at 4 Hz have in common, and milliseconds a frame
// (thread CPU time on one thread, without decoding).

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <opencv2/core.hpp>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/statistics.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/frontend/keyframe_selector.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"
#include "etalon/testing/program.h"
#include "track_statistics.h"

namespace {

double threadMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

void run(const std::string& folder_path, const etalon::IniFile& ini, int refinement_rounds) {
  using namespace etalon;
  const auto recording = openRecording(folder_path);
  const ImuBuffer imu(recording->imuSamples());
  StereoTrackerOptions options;
  ParameterSet parameters("frontend");
  options.declare(parameters);
  parameters.read(ini);
  StereoTracker tracker(recording->calibration(), options);
  KeyframeSelector selector(KeyframeSelectorOptions{});
  std::vector<TrackedFrame> frames;
  std::vector<SE3> T_WB;
  std::vector<int> keyframes;
  std::vector<double> milliseconds;
  for (size_t i = 0; i < recording->imageStamps().size(); ++i) {
    const TimeNs t = recording->imageStamps()[i];
    const auto truth = recording->groundTruth().at(t);
    if (!truth) continue;
    const LoadedFrame pair = recording->loadFrame(i);
    if (!pair.problem.empty()) throw DataError(pair.file, 0, pair.problem);
    const Eigen::Matrix3d R_prev_cur =
        frames.empty() ? Eigen::Matrix3d::Identity().eval()
                       : Preintegration(imu.between(frames.back().t, t), ImuBias(),
                                        recording->calibration().imu.noise)
                             .deltas()
                             .dR;
    const double start = threadMilliseconds();
    frames.push_back(tracker.track(t, pair.frame.left, pair.frame.right, R_prev_cur));
    milliseconds.push_back(threadMilliseconds() - start);
    T_WB.push_back(truth->T_WB);
    if (selector.isKeyframe(t)) keyframes.push_back(static_cast<int>(frames.size()) - 1);
  }
  T_WB = refinePoses(recording->calibration(), frames, std::move(T_WB), refinement_rounds);
  std::printf("%s: %zu frames, %zu keyframes\n%s", folder_path.c_str(), frames.size(),
              keyframes.size(),
              toText(judgeTracks(recording->calibration(), frames, T_WB, keyframes)).c_str());
  std::printf("milliseconds a frame: median %.2f, 95%% %.2f\n", quantile(milliseconds, 0.5),
              quantile(milliseconds, 0.95));
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  std::string folder;
  int refinement_rounds = 0;
  etalon::testing::IniOptions ini;
  CLI::App app("Judges the tracks of the stereo front end by ground truth", "track_quality");
  app.add_option("FOLDER", folder, "EuRoC folder with ground truth")->required();
  app.add_option("--refine", refinement_rounds, "Rounds in which the tracks refine the poses")
      ->check(CLI::NonNegativeNumber);
  ini.addTo(&app);
  return etalon::testing::runProgram(&app, argc, argv,
                                     [&] { run(folder, ini.ini(), refinement_rounds); });
}
