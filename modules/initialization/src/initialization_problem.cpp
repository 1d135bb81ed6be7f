#include "etalon/initialization/initialization_problem.h"

#include <atomic>
#include <mutex>
#include <string>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"

namespace etalon {

struct InitializationProblem::Lazy {
  std::once_flag once;
  std::atomic<bool> computed{false};
  Expected<VisualSolution> solution;
  double milliseconds = 0.0;
};

static void checkKeyframeIndices(const InitializationProblem::Data& data) {
  int previous = -1;
  for (const int index : data.keyframe_indices) {
    if (index <= previous || index >= static_cast<int>(data.frames.size())) {
      throw DataError("initialization problem", 0,
                      "keyframe index " + std::to_string(index) + " after " +
                          std::to_string(previous) + ": expected increasing indices into " +
                          std::to_string(data.frames.size()) + " frames");
    }
    previous = index;
  }
}

InitializationProblem::InitializationProblem(Data data) {
  checkKeyframeIndices(data);
  data_ = std::make_shared<const Data>(std::move(data));
  lazy_ = std::make_shared<Lazy>();
}

std::vector<const TrackedFrame*> InitializationProblem::keyframes() const {
  std::vector<const TrackedFrame*> result;
  for (int k = 0; k < keyframeCount(); ++k) result.push_back(&keyframe(k));
  return result;
}

std::vector<Preintegration> InitializationProblem::preintegrate(
    const ImuBias& bias, const ImuNoiseDensities& noise) const {
  std::vector<Preintegration> result;
  for (int k = 1; k < keyframeCount(); ++k) {
    result.emplace_back(imu().between(keyframe(k - 1).t, keyframe(k).t), bias, noise);
  }
  return result;
}

const Expected<VisualSolution>& InitializationProblem::visualSolution() const {
  std::call_once(lazy_->once, [this] {
    Stopwatch watch;
    std::vector<Eigen::Matrix3d> rotations;
    for (const Preintegration& p : preintegrate(priors().mean)) rotations.push_back(p.deltas().dR);
    lazy_->solution = solveStereoOdometry(calibration(), keyframes(), rotations, data_->odometry);
    lazy_->milliseconds = watch.lapMilliseconds();
    lazy_->computed = true;
  });
  return lazy_->solution;
}

bool InitializationProblem::visualSolutionComputed() const { return lazy_->computed; }

double InitializationProblem::visualSolutionMilliseconds() const {
  return lazy_->computed ? lazy_->milliseconds : 0.0;
}

Expected<const VisualSolution*> visualSolutionWith(const InitializationProblem& problem,
                                                   int min_landmarks) {
  const Expected<VisualSolution>& visual = problem.visualSolution();
  if (!visual) return refuse(visual.error());
  if (static_cast<int>(visual->landmarks.size()) < min_landmarks)
    return refuse(RefusalStatus::kTooFewTracks, "stereo odometry has ",
                  Value(visual->landmarks.size()), " landmarks in the window, at least ",
                  Bound(min_landmarks), " are wanted");
  return &*visual;
}

}  // namespace etalon
