#include "etalon/initialization/initializer.h"

namespace my_lab {

/** The smallest plugin: believes that the platform stands level. */
class Level : public etalon::Initializer {
  DEFINE_MRPT_OBJECT(Level, my_lab)

 public:
  void declareParameters(etalon::ParameterSet& parameters) override {
    parameters.add("max_rate_rps", &max_rate_rps_, {0.0, 10.0},
                   "Refuse if a gyro measurement is larger, rad/s.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  etalon::InitializationResult solve(const etalon::InitializationProblem& problem) const override {
    for (const etalon::ImuSample& sample : problem.imu().samples()) {
      if (sample.gyro.norm() > max_rate_rps_) {
        return etalon::InitializationResult::refusal(etalon::InitializationStatus::kImplausible,
                                                     "the platform turns", sample.gyro.norm());
      }
    }
    etalon::InitializationResult result;
    result.status = etalon::InitializationStatus::kSuccess;
    for (int k = 0; k < problem.keyframeCount(); ++k) {
      result.states.push_back({problem.keyframe(k).t, etalon::SE3(), Eigen::Vector3d::Zero()});
    }
    return result;
  }

 private:
  double max_rate_rps_ = 0.05;
};

IMPLEMENTS_MRPT_OBJECT(Level, etalon::Initializer, my_lab)

}  // namespace my_lab

ETALON_REGISTER_INITIALIZER(Level, my_lab, "level", "0.3", "believes that the platform is level")
