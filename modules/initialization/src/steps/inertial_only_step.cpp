#include "etalon/initialization/steps/inertial_only_step.h"

#include <cmath>

#include "etalon/initialization/steps/gravity_alignment.h"

namespace etalon {

void InertialOnlyStepOptions::declare(ParameterSet& parameters) {
  parameters.add("prior_gyro_information", &prior_gyro_information, {0.0, 1e18},
                 "Information of the prior on b_g, 1/(rad/s)^2 (ORB-SLAM3: 1e2, sigma 0.1 rad/s).");
  parameters.add("prior_accel_information", &prior_accel_information, {0.0, 1e18},
                 "Information of the prior on b_a, 1/(m/s^2)^2 (ORB-SLAM3: 1e5, sigma 3.2e-3 "
                 "m/s^2).");
  parameters.add("max_iterations", &max_iterations, {1, 100000},
                 "Levenberg-Marquardt iterations, at most (ORB-SLAM3: 200).");
  parameters.add("reintegrations", &reintegrations, {0, 100},
                 "How often, at most, the raw IMU is integrated anew at the biases found and the "
                 "MAP solved again.");
  parameters.add("min_landmarks", &min_landmarks, {3, 100000},
                 "Refuse if stereo odometry has fewer landmarks in the window.");
  parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg, {0.0, 180.0},
                 "Refuse if the MAP's own standard deviation of the gravity direction is larger, "
                 "deg.");
}

Expected<InertialOnlyStep> solveInertialOnlyStep(
    const InitializationProblem& problem, const InertialOnlyStepOptions& options,
    const std::optional<GyroBiasMeasurement>& gyro_bias, const GyroBiasErrors& gyro_bias_errors) {
  const auto found = visualSolutionWith(problem, options.min_landmarks);
  if (!found) return refuse(found.error());
  const VisualSolution& visual = **found;

  InertialOnlyOptions map_options;
  map_options.prior_gyro_information = options.prior_gyro_information;
  map_options.prior_accel_information = options.prior_accel_information;
  map_options.prior_mean = problem.priors().mean;
  map_options.gravity_mps2 = problem.gravityMagnitude();
  map_options.max_iterations = options.max_iterations;
  map_options.gyro_bias = gyro_bias;

  InertialOnlyStep step;
  ImuBias bias = problem.priors().mean;
  if (gyro_bias) bias.gyro = gyro_bias->gyro;
  // A first-order correction of b_g is off by (|db_g| dt)^2: below 1e-5 rad/s that is nothing.
  constexpr double kStandsStill = 1e-5;
  for (int pass = 0; pass <= options.reintegrations; ++pass) {
    step.preintegrations = problem.preintegrate(bias);
    step.map = solveInertialOnlyMap(visual.T_VB, step.preintegrations, map_options);
    const double moved =
        (step.map.bias.gyro - bias.gyro).norm() + (step.map.bias.accel - bias.accel).norm();
    bias = step.map.bias;
    if (!step.map.summary.converged() || moved < kStandsStill) break;
  }
  const SolverSummary& summary = step.map.summary;
  if (!summary.usable())
    return refuse(summary.termination == Termination::kSingular ? RefusalStatus::kIllConditioned
                                                                : RefusalStatus::kNotConverged,
                  "the inertial-only MAP failed after ", Value(summary.iterations),
                  " iterations: ", summary.message);
  if (!summary.converged())
    return refuse(RefusalStatus::kNotConverged, "the inertial-only MAP did not converge in ",
                  Value(summary.iterations), " iterations (at most ", Bound(options.max_iterations),
                  ")");
  if (step.map.covariance.size() == 0)
    return refuse(RefusalStatus::kIllConditioned,
                  "the inertial-only MAP is singular: smallest information of gravity ",
                  Value(step.map.smallest_eigenvalue_gravity));
  const auto known = checkGravityDirection(1.0 / std::sqrt(step.map.smallest_eigenvalue_gravity),
                                           options.max_sigma_gravity_deg);
  if (!known) return refuse(known.error());
  step.errors =
      inertialOnlyErrors(problem, step.preintegrations, map_options, step.map, gyro_bias_errors);
  return step;
}

}  // namespace etalon
