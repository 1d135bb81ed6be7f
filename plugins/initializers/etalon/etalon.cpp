#include "etalon/core/angles.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/joint/joint_map.h"

namespace etalon::plugins {

/** One MAP over poses, velocities, gravity and biases from tracks and IMU (README.md beside this
 * file). */
class EtalonInitializer : public Initializer {
  DEFINE_MRPT_OBJECT(EtalonInitializer, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    map_.declare(parameters);
    parameters.add("sigma_shared_deg", &sigma_shared_deg_, {0.0, 10.0},
                   "Standard deviation of the error that all pixels of a keyframe share, as a "
                   "rotation per axis, deg (calibration).");
    parameters.add("sigma_turn_deg", &sigma_turn_deg_, {0.0, 10.0},
                   "Standard deviation of the turn of the cameras in the body against the "
                   "calibration, per axis, deg.");
    parameters.add(
        "least_pixel_share", &least_pixel_share_, {1e-3, 1.0},
        "Least share of sigma_px that counts as the pixels' noise where the window's own "
        "residuals show less; 1: sigma_px as it is.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    JointMapOptions options = map_;
    options.least_noise = least_pixel_share_;
    options.model.slow_accel = problem.priors().slow_accel;
    options.model.sigma_shared_rad = radians(sigma_shared_deg_);
    options.model.sigma_turn_rad = radians(sigma_turn_deg_);
    return solveJointMap(problem, options);
  }

 private:
  JointMapOptions map_;
  double sigma_shared_deg_ = 0.02;
  double sigma_turn_deg_ = 0.05;
  double least_pixel_share_ = 0.1;
};

IMPLEMENTS_MRPT_OBJECT(EtalonInitializer, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(EtalonInitializer, etalon::plugins, "etalon", "1.0",
                            "one MAP over poses, velocities, gravity and biases from tracks and "
                            "IMU, with covariance")
