#pragma once

#include <functional>
#include <vector>

#include "etalon/datasets/sensor_source.h"
#include "etalon/initialization/initializer.h"
#include "etalon/pipeline/pipeline.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon::pipeline_test {

using Script = std::function<InitializationResult(const InitializationProblem&)>;

/** Says what it is told to say. */
class Scripted : public Initializer {
  DEFINE_MRPT_OBJECT(Scripted, etalon::pipeline_test)

 public:
  Scripted() = default;
  explicit Scripted(Script script) : script_(std::move(script)) {}
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    return script_(problem);
  }

 private:
  Script script_;
};

constexpr double kFrameRateHz = 10.0;  // every frame is a keyframe
constexpr int kFirstFrame = 12;        // by then it flies
constexpr int kFrames = 8;

/** A short flight, rendered once for all tests of the program. */
struct Flight {
  Flight();
  static const Flight& instance();
  SE3 truth(TimeNs t) const { return trajectory.at(t).T_WB; }

  ProfileTrajectory trajectory;
  StereoInertialCalibration calibration;
  std::vector<StereoFrame> frames;
  std::vector<ImuSample> imu;  ///< without noise
};

/** The truth of the flight, as a Script. */
InitializationResult trueInitialization(const InitializationProblem& problem);

/** Distance of the estimate from the flight's position at its stamp, m. */
double positionError(const FrameEstimate& estimate);

}  // namespace etalon::pipeline_test
