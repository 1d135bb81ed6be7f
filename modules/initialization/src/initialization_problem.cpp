#include "etalon/initialization/initialization_problem.h"

#include <mutex>

#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"

namespace etalon {

struct InitializationProblem::Lazy {
  VisualSolver solver;
  std::once_flag once;
  bool computed = false;
  VisualSolution solution;
  double milliseconds = 0.0;
};

InitializationProblem::InitializationProblem(Data data, VisualSolver visual_solver)
    : data_(std::make_shared<const Data>(std::move(data))), lazy_(std::make_shared<Lazy>()) {
  lazy_->solver = std::move(visual_solver);
}

std::vector<Preintegration> InitializationProblem::preintegrate(const ImuBias& bias) const {
  std::vector<Preintegration> result;
  for (int k = 1; k < keyframeCount(); ++k)
    result.emplace_back(imu().between(keyframe(k - 1).t, keyframe(k).t), bias, imuNoise());
  return result;
}

const VisualSolution& InitializationProblem::visualSolution() const {
  std::call_once(lazy_->once, [this] {
    if (!lazy_->solver) throw ConfigError("this problem has no stereo odometry to offer");
    Stopwatch watch;
    lazy_->solution = lazy_->solver();
    lazy_->milliseconds = watch.lapMilliseconds();
    lazy_->computed = true;
  });
  return lazy_->solution;
}

bool InitializationProblem::visualSolutionComputed() const { return lazy_->computed; }
double InitializationProblem::visualSolutionMilliseconds() const { return lazy_->milliseconds; }

}  // namespace etalon
