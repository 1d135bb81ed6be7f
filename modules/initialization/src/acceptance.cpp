#include "etalon/initialization/acceptance.h"

#include <cmath>
#include <cstdio>

namespace etalon {

void AcceptanceOptions::declare(ParameterSet& parameters) {
  parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg, {0.0, 180.0},
                 "Refuse if the standard deviation of the gravity direction is larger, deg.");
  parameters.add("max_sigma_velocity_mps", &max_sigma_velocity_mps, {0.0, 100.0},
                 "Refuse if the standard deviation of a component of the last keyframe's velocity "
                 "is larger, m/s.");
  parameters.add("max_gyro_bias_rps", &max_gyro_bias_rps, {0.0, 100.0},
                 "Refuse a gyro bias whose norm is larger than is plausible, rad/s.");
  parameters.add("max_accel_bias_mps2", &max_accel_bias_mps2, {0.0, 1000.0},
                 "Refuse an accelerometer bias whose norm is larger than is plausible, m/s^2.");
  parameters.add("max_chi2_per_dof_inertial", &max_chi2_per_dof_inertial, {0.0, 1e9},
                 "Refuse if the whitened inertial residuals after VI-BA are larger (1 is what the "
                 "noise model promises).");
  parameters.add("min_inlier_share", &min_inlier_share, {0.0, 1.0},
                 "Refuse if a smaller share of the visual measurements agrees with the solution.");
  parameters.add("min_measurements", &min_measurements, {0, 1000000},
                 "Refuse if fewer visual measurements (a landmark in one camera of one keyframe) "
                 "agree with the solution.");
}

namespace {

AcceptanceDecision refuse(InitializationStatus status, double value, const char* format,
                          double bound) {
  char text[256];
  std::snprintf(text, sizeof(text), format, value, bound);
  AcceptanceDecision decision;
  decision.status = status;
  decision.reason = text;
  decision.value = value;
  return decision;
}

}  // namespace

AcceptanceDecision judge(const VisualInertialBaResult& refined, const AcceptanceOptions& options) {
  using Status = InitializationStatus;
  if (!refined.message.empty()) {
    AcceptanceDecision decision;
    decision.reason = "visual-inertial BA failed: " + refined.message;
    return decision;
  }
  if (!refined.converged) {
    char text[160];
    std::snprintf(text, sizeof(text),
                  "the visual-inertial BA has not converged: its last step was %.2f standard "
                  "deviations long after %d iterations",
                  refined.last_step_sigmas, refined.iterations);
    AcceptanceDecision decision;
    decision.reason = text;
    decision.value = refined.last_step_sigmas;
    return decision;
  }
  const double inliers = refined.inlier_measurements;
  if (inliers < options.min_measurements)
    return refuse(Status::kTooFewTracks, inliers,
                  "%.0f visual measurements agree with the solution, at least %.0f are wanted",
                  options.min_measurements);
  const double share = inliers / refined.measurements;
  if (share < options.min_inlier_share)
    return refuse(Status::kNotConverged, share,
                  "a share of %.2f of the visual measurements agrees with the solution, at least "
                  "%.2f is wanted",
                  options.min_inlier_share);
  const double chi2 = refined.chi2_inertial / refined.dof_inertial;
  if (!(chi2 <= options.max_chi2_per_dof_inertial))
    return refuse(Status::kNotConverged, chi2,
                  "the inertial residuals have chi2/dof %.2f, at most %.2f is wanted",
                  options.max_chi2_per_dof_inertial);
  if (refined.covariance.size() == 0) {
    AcceptanceDecision decision;
    decision.status = Status::kIllConditioned;
    decision.reason = "the normal equations are singular: the data do not determine the state";
    return decision;
  }
  const double sigma_gravity_deg = refined.sigmaTilt() * 180.0 / M_PI;
  if (!(sigma_gravity_deg <= options.max_sigma_gravity_deg))
    return refuse(Status::kIllConditioned, sigma_gravity_deg,
                  "the gravity direction is known to %.2f deg (1 sigma), at most %.2f is wanted",
                  options.max_sigma_gravity_deg);
  const double sigma_velocity = refined.sigmaVelocity();
  if (!(sigma_velocity <= options.max_sigma_velocity_mps))
    return refuse(Status::kIllConditioned, sigma_velocity,
                  "the velocity is known to %.3f m/s (1 sigma), at most %.3f is wanted",
                  options.max_sigma_velocity_mps);
  const double gyro_bias = refined.bias.gyro.norm();
  if (!(gyro_bias <= options.max_gyro_bias_rps))
    return refuse(Status::kImplausible, gyro_bias,
                  "a gyro bias of %.3f rad/s is not plausible, at most %.3f is",
                  options.max_gyro_bias_rps);
  const double accel_bias = refined.bias.accel.norm();
  if (!(accel_bias <= options.max_accel_bias_mps2))
    return refuse(Status::kImplausible, accel_bias,
                  "an accelerometer bias of %.3f m/s^2 is not plausible, at most %.3f is",
                  options.max_accel_bias_mps2);
  AcceptanceDecision decision;
  decision.accepted = true;
  decision.status = Status::kSuccess;
  return decision;
}

}  // namespace etalon
