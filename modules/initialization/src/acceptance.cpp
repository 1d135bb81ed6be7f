#include "etalon/initialization/acceptance.h"

#include <cmath>
#include <cstdio>
#include <optional>

#include "etalon/core/degrees.h"
#include "etalon/core/statistics.h"

namespace etalon {

void AcceptanceOptions::declare(ParameterSet& parameters) {
  parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg, {0.0, 180.0},
                 "Refuse if the standard deviation of the gravity direction is larger, deg.");
  parameters.add("max_sigma_velocity_mps", &max_sigma_velocity_mps, {0.0, 100.0},
                 "Refuse if the standard deviation of a component of the last keyframe's velocity "
                 "is larger, m/s.");
  parameters.add("false_alarm_rate", &false_alarm_rate, {0.0, 0.5},
                 "Share of good windows that each chi-square test may refuse: of the residuals of "
                 "gyro, accelerometer and vision, were their noise noise_margin times what is "
                 "believed, and of b_g and b_a against their prior. 0: no such test.");
  parameters.add("noise_margin", &noise_margin, {0.1, 1e9},
                 "How many times what is believed a sensor's noise may be (standard deviations) "
                 "before its residuals are refused. No IMU is quite as its factors say.");
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

using Status = InitializationStatus;
using Refusal = std::optional<AcceptanceDecision>;

Refusal judgeSolution(const VisualInertialBaResult& refined) {
  AcceptanceDecision decision;
  if (!refined.summary.usable()) {
    decision.reason = "visual-inertial BA failed: " + refined.summary.message;
    return decision;
  }
  if (refined.summary.converged()) return std::nullopt;
  char text[160];
  std::snprintf(text, sizeof(text),
                "the visual-inertial BA has not converged: its last step was %.2f standard "
                "deviations long after %d iterations",
                refined.last_step_sigmas, refined.summary.iterations);
  decision.reason = text;
  decision.value = refined.last_step_sigmas;
  return decision;
}

Refusal judgeSupport(const VisualInertialBaResult& refined, const AcceptanceOptions& options) {
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
  return std::nullopt;
}

Refusal judgeCovariance(const VisualInertialBaResult& refined, const AcceptanceOptions& options) {
  if (refined.covariance.size() == 0) {
    AcceptanceDecision decision;
    decision.status = Status::kIllConditioned;
    decision.reason = "the normal equations are singular: the data do not determine the state";
    return decision;
  }
  const double sigma_gravity_deg = degrees(refined.sigmaTilt());
  if (!(sigma_gravity_deg <= options.max_sigma_gravity_deg))
    return refuse(Status::kIllConditioned, sigma_gravity_deg,
                  "the gravity direction is known to %.2f deg (1 sigma), at most %.2f is wanted",
                  options.max_sigma_gravity_deg);
  const double sigma_velocity = refined.sigmaVelocity();
  if (!(sigma_velocity <= options.max_sigma_velocity_mps))
    return refuse(Status::kIllConditioned, sigma_velocity,
                  "the velocity is known to %.3f m/s (1 sigma), at most %.3f is wanted",
                  options.max_sigma_velocity_mps);
  return std::nullopt;
}

/** @param z quantile of the normal distribution at the false-alarm rate */
Refusal judgeResiduals(const NoiseCheck& noise, double z, double margin) {
  const struct {
    const char* format;
    const ResidualGroup& group;
    double square;  ///< tr M^2
  } sensors[] = {{"the gyro's residuals have chi2/dof %.2f, at most %.2f is wanted", noise.gyro,
                  noise.coupling(0, 0)},
                 {"the accelerometer's residuals have chi2/dof %.2f, at most %.2f is wanted",
                  noise.accel, noise.coupling(1, 1)},
                 {"the pixels' residuals have chi2/dof %.2f, at most %.2f is wanted", noise.vision,
                  noise.coupling(2, 2)}};
  for (const auto& sensor : sensors) {
    const double dof = sensor.group.dof;
    if (!(dof > 0.0 && sensor.square > 0.0)) continue;  // nothing is left of what the fit takes out
    const double scale = sensor.square / dof;
    const double expected = dof + (margin * margin - 1.0) * sensor.square;
    const double bound = expected / dof * scale * chiSquareQuantile(dof / scale, z) / dof;
    const double ratio = sensor.group.chi2 / dof;
    if (!(ratio <= bound)) return refuse(Status::kNotConverged, ratio, sensor.format, bound);
  }
  return std::nullopt;
}

/** @param z quantile of the normal distribution at the false-alarm rate */
Refusal judgeBiases(const VisualInertialBaResult& refined, double z) {
  const double farthest = std::sqrt(chiSquareQuantile(3.0, z));
  if (!(refined.gyro_bias_sigmas <= farthest))
    return refuse(Status::kImplausible, refined.gyro_bias_sigmas,
                  "the gyro bias is %.2f standard deviations of its prior from the prior's mean, "
                  "at most %.2f is plausible",
                  farthest);
  if (!(refined.accel_bias_sigmas <= farthest))
    return refuse(Status::kImplausible, refined.accel_bias_sigmas,
                  "the accelerometer bias is %.2f standard deviations of its prior from the "
                  "prior's mean, at most %.2f is plausible",
                  farthest);
  return std::nullopt;
}

}  // namespace

AcceptanceDecision judge(const VisualInertialBaResult& refined, const AcceptanceOptions& options) {
  if (const Refusal refusal = judgeSolution(refined)) return *refusal;
  if (const Refusal refusal = judgeSupport(refined, options)) return *refusal;
  if (const Refusal refusal = judgeCovariance(refined, options)) return *refusal;
  if (options.false_alarm_rate > 0.0) {
    const double z = normalQuantile(options.false_alarm_rate);
    if (const Refusal refusal = judgeResiduals(refined.noise, z, options.noise_margin))
      return *refusal;
    if (const Refusal refusal = judgeBiases(refined, z)) return *refusal;
  }
  AcceptanceDecision decision;
  decision.accepted = true;
  decision.status = Status::kSuccess;
  return decision;
}

}  // namespace etalon
