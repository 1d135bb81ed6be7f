#include "etalon/initialization/acceptance.h"

#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/initialization/predicted_errors.h"

namespace etalon {

void AcceptanceOptions::declare(ParameterSet& parameters) {
  parameters.add("gravity_deg", &gravity_deg, {0.0, 180.0},
                 "A start is accepted when the direction of gravity is predicted to be off by no "
                 "more than this, deg.");
  parameters.add("velocity_mps", &velocity_mps, {0.0, 100.0},
                 "The same of the last keyframe's velocity, m/s.");
  parameters.add("gyro_bias_rps", &gyro_bias_rps, {0.0, 100.0},
                 "The same of the gyro bias, rad/s.");
  parameters.add("confidence", &confidence, {0.01, 0.999999},
                 "Probability with which each of the three is kept, by the estimate's own "
                 "covariance.");
  parameters.add("false_alarm_rate", &false_alarm_rate, {0.0, 0.5},
                 "Share of good windows that each chi-square test may refuse: of the residuals of "
                 "gyro, accelerometer and vision (assuming noise_margin times the configured "
                 "noise), of b_g and b_a against their prior, and of an estimate against that of "
                 "the window before. 0: no such test.");
  parameters.add("noise_margin", &noise_margin, {0.1, 1e9},
                 "Factor by which a sensor's noise (standard deviation) may exceed the configured "
                 "one before its residuals are refused, because no IMU fits its factors exactly; "
                 "the difference from the window before has the same margin.");
  parameters.add("min_inlier_share", &min_inlier_share, {0.0, 1.0},
                 "Refuse if a smaller share of the visual measurements of landmarks that can be "
                 "triangulated agrees with the solution.");
  parameters.add("min_measurements", &min_measurements, {0, 1000000},
                 "Refuse if fewer visual measurements (a landmark in one camera of one keyframe) "
                 "agree with the solution.");
}

namespace {

using Status = RefusalStatus;

Expected<void> judgeSolution(const VisualInertialBaResult& refined) {
  if (!refined.summary.usable())
    return refuse(Status::kNotConverged, "visual-inertial BA failed: ", refined.summary.message);
  if (!refined.summary.converged())
    return refuse(Status::kNotConverged,
                  "the visual-inertial BA has not converged: its last step was ",
                  Value(refined.last_step_sigmas, 2), " standard deviations long after ",
                  refined.summary.iterations, " iterations");
  return {};
}

Expected<void> judgeSupport(const VisualInertialBaResult& refined,
                            const AcceptanceOptions& options) {
  // Landmarks that cannot be triangulated, as those of one camera at rest, do not disagree; but
  // where that is said of nearly all, the images have not been asked.
  constexpr double kLeastKnown = 0.1;
  const double all = refined.bundle.window.measurements.size();
  if (refined.measurements < kLeastKnown * all)
    return refuse(Status::kTooFewTracks, "a share of ", Value(refined.measurements / all, 2),
                  " of the visual measurements is of landmarks that can be triangulated, at least ",
                  Bound(kLeastKnown, 2), " is wanted");
  const int inliers = refined.inlier_measurements;
  if (inliers < options.min_measurements)
    return refuse(Status::kTooFewTracks, Value(inliers),
                  " visual measurements agree with the solution, at least ",
                  Bound(options.min_measurements), " are wanted");
  const double share = static_cast<double>(inliers) / refined.measurements;
  if (!(share >= options.min_inlier_share))
    return refuse(Status::kNotConverged, "a share of ", Value(share, 2),
                  " of the visual measurements agrees with the solution, at least ",
                  Bound(options.min_inlier_share, 2), " is wanted");
  return {};
}

/** How a direction is called in the body. */
std::string axisInWords(const Eigen::Vector3d& direction) {
  constexpr double kNear = 0.9;  // 26 deg
  const char* names[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i)
    if (std::abs(direction[i]) > kNear) return std::string("the body's ") + names[i];
  return format("(%.1f, %.1f, %.1f) of the body", direction.x(), direction.y(), direction.z());
}

/** "worst about the body's x", or "alike about both level axes". */
std::string whereInWords(const PredictedError& error, const char* preposition,
                         const Eigen::Matrix3d& R_WB) {
  if (error.alike_in_all_directions) return "alike in all directions";
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  direction.head(error.worst.size()) = error.worst;
  return std::string("worst ") + preposition + " " + axisInWords(R_WB.transpose() * direction);
}

Expected<void> judgeCovariance(const VisualInertialBaResult& refined,
                               const AcceptanceOptions& options) {
  if (refined.covariance.size() == 0)
    return refuse(Status::kIllConditioned,
                  "the normal equations are singular: the data do not determine the state");
  return judgePrediction(claimedCovariance(refined), refined.states.back().T_WB.R, options);
}

Expected<void> judgeResiduals(const NoiseCheck& noise, double false_alarm_rate, double margin) {
  const struct {
    const char* name;
    const ResidualGroup& group;
    double square;  ///< tr M^2
  } sensors[] = {{"gyro's", noise.gyro, noise.coupling(0, 0)},
                 {"accelerometer's", noise.accel, noise.coupling(1, 1)},
                 {"pixels'", noise.vision, noise.coupling(2, 2)}};
  for (const auto& sensor : sensors) {
    const double dof = sensor.group.dof;
    if (!(dof > 0.0 && sensor.square > 0.0)) continue;  // nothing is left of what the fit takes out
    const double scale = sensor.square / dof;
    const double expected = dof + (margin * margin - 1.0) * sensor.square;
    const double bound =
        expected / dof * scale * chiSquareQuantile(dof / scale, false_alarm_rate) / dof;
    const double ratio = sensor.group.chi2 / dof;
    if (!(ratio <= bound))
      return refuse(Status::kNotConverged, "the ", sensor.name, " residuals have chi2/dof ",
                    Value(ratio, 2), ", at most ", Bound(bound, 2), " is wanted");
  }
  return {};
}

Expected<void> judgeBiases(const VisualInertialBaResult& refined, double false_alarm_rate) {
  const double farthest = std::sqrt(chiSquareQuantile(3.0, false_alarm_rate));
  const auto advice = [](const char* key) {
    return std::string("if every attempt says so, is [priors] ") + key +
           " too small for this IMU, or the device file another one's?";
  };
  if (!(refined.gyro_bias_sigmas <= farthest))
    return refuse(Status::kImplausible, "the gyro bias is ", Value(refined.gyro_bias_sigmas, 2),
                  " standard deviations of its prior from the prior's mean, at most ",
                  Bound(farthest, 2), " is plausible; ", advice("gyro_bias_sigma_rps"));
  if (!(refined.accel_bias_sigmas <= farthest))
    return refuse(Status::kImplausible, "the accelerometer bias is ",
                  Value(refined.accel_bias_sigmas, 2),
                  " standard deviations of its prior from the prior's mean, at most ",
                  Bound(farthest, 2), " is plausible; ", advice("accel_bias_sigma_mps2"));
  return {};
}

}  // namespace

Expected<void> judgePrediction(const Eigen::MatrixXd& covariance, const Eigen::Matrix3d& R_WB,
                               const AcceptanceOptions& options) {
  const std::string confidence = format(" (%.4g %%)", 100.0 * options.confidence);
  const auto predicted = [&](Eigen::Index start, Eigen::Index size) {
    return predictedError(covariance.block(start, start, size, size), options.confidence);
  };
  const PredictedError tilt = predicted(6, 2), velocity = predicted(8, 3), gyro = predicted(0, 3);
  if (const double bound = degrees(tilt.bound); !(bound <= options.gravity_deg))
    return refuse(Status::kIllConditioned, "gravity may be off by ", Value(bound), " deg",
                  confidence, ", ", whereInWords(tilt, "about", R_WB), "; at most ",
                  Bound(options.gravity_deg),
                  " is wanted: tilt, or accelerate sideways, so that the accelerometer's bias "
                  "shows");
  if (!(velocity.bound <= options.velocity_mps))
    return refuse(Status::kIllConditioned, "the velocity may be off by ", Value(velocity.bound),
                  " m/s", confidence, ", ", whereInWords(velocity, "along", R_WB), "; at most ",
                  Bound(options.velocity_mps),
                  " is wanted: show the cameras something nearer, or accelerate");
  if (!(gyro.bound <= options.gyro_bias_rps))
    return refuse(
        Status::kIllConditioned, "the gyro bias may be off by ", Value(gyro.bound), " rad/s",
        confidence, ", ", whereInWords(gyro, "about", Eigen::Matrix3d::Identity()), "; at most ",
        Bound(options.gyro_bias_rps), " is wanted: show the cameras more, or wait for more images");
  return {};
}

Expected<void> judge(const VisualInertialBaResult& refined, const AcceptanceOptions& options) {
  Expected<void> verdict = judgeSolution(refined);
  if (verdict) verdict = judgeSupport(refined, options);
  // The covariance rests on the noise, and is right only where the residuals are.
  const double alarms = options.false_alarm_rate;
  if (verdict && alarms > 0.0)
    verdict = judgeResiduals(refined.noise, alarms, options.noise_margin);
  if (verdict) verdict = judgeCovariance(refined, options);
  if (verdict && alarms > 0.0) verdict = judgeBiases(refined, alarms);
  return verdict;
}

}  // namespace etalon
