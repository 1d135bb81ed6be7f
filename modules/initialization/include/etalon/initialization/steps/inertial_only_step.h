#pragma once

#include <optional>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/initialization/steps/state_errors.h"

namespace etalon {

/** Parameters of the inertial-only MAP as a step of an initializer; defaults of ORB-SLAM3. */
struct InertialOnlyStepOptions {
  double prior_gyro_information = 1e2;
  double prior_accel_information = 1e5;
  int max_iterations = 200;
  int reintegrations = 3;
  int min_landmarks = 15;
  double max_sigma_gravity_deg = 5.0;

  void declare(ParameterSet& parameters);
};

/** The MAP's solution with the preintegrations at its biases. */
struct InertialOnlyStep {
  InertialOnlyResult map;
  std::vector<Preintegration> preintegrations;
  std::optional<StateErrors> errors;  ///< none where stereo odometry has no covariance
};

/**
 * The inertial-only MAP of the disjoint stereo initializers on the poses of stereo
 * odometry; the raw IMU is re-integrated at the biases found and the MAP solved again until they
 * stand still (at most `reintegrations` times).
 * @param gyro_bias a start for b_g, or a measurement of it, found elsewhere
 * @param gyro_bias_errors its own, for the errors, whatever information the MAP gives it
 */
Expected<InertialOnlyStep> solveInertialOnlyStep(
    const InitializationProblem& problem, const InertialOnlyStepOptions& options,
    const std::optional<GyroBiasMeasurement>& gyro_bias = {},
    const GyroBiasErrors& gyro_bias_errors = {});

}  // namespace etalon
