#include "etalon/initialization/initializer.h"
#include "etalon/initialization/joint/joint_map.h"

namespace etalon::plugins {

/**
 * Velocity, gravity and gyro bias from the tracks and the IMU at once, no visual odometry
 * (Martinelli 2014, Dong-Si and Mourikis 2012, Kaiser et al. 2017; README.md beside this file).
 */
class JointClosedForm : public Initializer {
  DEFINE_MRPT_OBJECT(JointClosedForm, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    map_.declare(parameters);
    parameters.add("accel_bias", &map_.model.estimate_accel_bias,
                   {{"mean", false}, {"estimate", true}},
                   "b_a stays at the mean of its prior (as published: zero), or is an unknown with "
                   "that prior.");
    parameters.add(
        "imu_noise", &map_.model.imu_noise,
        "Weight the rows by the noise of the IMU as well; false: the IMU counts as exact (as "
        "published).");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    return solveJointMap(problem, map_);
  }

 private:
  JointMapOptions map_;
};

IMPLEMENTS_MRPT_OBJECT(JointClosedForm, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(JointClosedForm, etalon::plugins, "joint_closed_form", "1.1",
                            "velocity, gravity and gyro bias from tracks and IMU at once "
                            "(Martinelli, Dong-Si and Mourikis, Kaiser)")
