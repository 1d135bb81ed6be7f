#include "etalon/contract/synthetic_window.h"

#include "etalon/imu/imu_noise.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon::testing {

InitializationProblem makeProblem(const SyntheticWindow& window,
                                  const SyntheticWindowOptions& options) {
  ImuNoiseOptions factors;
  factors.gyro_noise_factor = factors.accel_noise_factor = options.assumed_noise_factor;
  WindowOptions window_options;
  window_options.gravity_mps2 = options.gravity_mps2;
  window_options.priors = options.priors;
  window_options.odometry.sigma_px = options.assumed_sigma_px;
  return etalon::makeProblem(window.calibration, factors.apply(window.calibration.imu.noise),
                             window_options, window.frames, window.keyframe_indices, window.imu);
}

WindowErrors errorsOf(const std::vector<StampedState>& states, const ImuBias& bias,
                      const SyntheticWindow& window) {
  GroundTruth truth;
  truth.states = window.truth;
  truth.has_velocity = truth.has_biases = true;
  return evaluateWindow(states, bias, truth);
}

Eigen::Matrix<double, 11, 1> estimationError(const Initialization& result,
                                             const SyntheticWindow& window) {
  return etalon::estimationError(
      result.states, result.bias,
      {window.truth.front().T_WB.R, window.truth.back().v_WB, window.bias});
}

}  // namespace etalon::testing
