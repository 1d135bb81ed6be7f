#include "truth_teller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace etalon::testing {

IMPLEMENTS_MRPT_OBJECT(TruthTeller, etalon::Initializer, etalon::testing)

namespace {

struct Known {
  Motion motion;
  SyntheticWindow window;
};

/** Windows without noise, and with that of the checks that compare and draw. */
const std::vector<Known>& knownWindows() {
  static const std::vector<Known> windows = [] {
    std::vector<Known> all;
    for (const Motion motion : kAllMotions)
      for (const unsigned seed : {1U, 3U, 5U, 7U, 8U}) {
        SyntheticWindowOptions options;
        options.motion = motion;
        options.seed = seed;
        options.landmarks = 1;
        all.push_back({motion, makeSyntheticWindow(options)});
      }
    return all;
  }();
  return windows;
}

/** Whether a pixel has moved by more than noise between first and last frame. */
bool tracksMove(const InitializationProblem& problem) {
  std::map<LandmarkId, Eigen::Vector2d> first;
  for (const Observation& o : problem.frames().front().observations) first[o.id] = o.left;
  for (const Observation& o : problem.frames().back().observations) {
    const auto before = first.find(o.id);
    if (before != first.end() && (o.left - before->second).norm() > 5.0) return true;
  }
  return false;
}

/** The window whose rates and forces are nearest: noise and biases are small against motions, and
 * what stands still or flies straight is told apart by its attitude alone. */
const Known& nearest(const InitializationProblem& problem) {
  const bool tracks_move = tracksMove(problem);
  const Known* best = nullptr;
  double least = 0.0;
  const auto& samples = problem.imu().samples();
  for (const Known& known : knownWindows()) {
    const auto& own = known.window.imu.samples();
    double sum = 0.0;
    for (size_t i = 0; i < std::min(own.size(), samples.size()); ++i)
      sum += (own[i].gyro - samples[i].gyro).squaredNorm() +
             (own[i].accel - samples[i].accel).squaredNorm();
    // Standing still and flying straight look alike to an IMU: the tracks know.
    if (known.motion == (tracks_move ? Motion::kStandstill : Motion::kConstantVelocity)) sum += 1e9;
    if (!best || sum < least) {
      best = &known;
      least = sum;
    }
  }
  return *best;
}

}  // namespace

Motion motionOf(const InitializationProblem& problem) { return nearest(problem).motion; }

Change onlyFor(Motion motion, const Change& change) {
  return [=](const InitializationProblem& problem, InitializationResult* result) {
    if (motionOf(problem) == motion) change(problem, result);
  };
}

Change refusing(const std::string& reason) {
  return [reason](const InitializationProblem&, InitializationResult* result) {
    *result = refuse(RefusalStatus::kTooLittleMotion, reason);
  };
}

InitializationResult TruthTeller::solve(const InitializationProblem& problem) const {
  const SyntheticWindow& window = nearest(problem).window;
  Initialization truth;
  truth.states = window.truth;
  truth.states.resize(static_cast<size_t>(problem.keyframeCount()), window.truth.back());
  for (int k = 0; k < problem.keyframeCount(); ++k) truth.states[k].t = problem.keyframe(k).t;
  truth.covariance = 1e-6 * Eigen::MatrixXd::Identity(11, 11);
  InitializationResult result = std::move(truth);
  change_(problem, &result);
  return result;
}

ContractCheck checkHere(const std::string& name, const Initializer& initializer,
                        ContractOptions options) {
  options.only = {name};
  options.isolated = false;
  const ContractReport report = checkContract(initializer, options);
  EXPECT_EQ(report.checks.size(), 1U);
  return report.checks.front();
}

}  // namespace etalon::testing
