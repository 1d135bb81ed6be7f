#pragma once

#include "etalon/core/parameters.h"
#include "etalon/core/refusal.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/** Section [acceptance]: when an initialization, refined by VI-BA, is good enough to start the
 * odometry. */
struct AcceptanceOptions {
  double gravity_deg = 2.0;
  double velocity_mps = 0.1;
  double gyro_bias_rps = 0.02;
  double confidence = 0.95;
  double false_alarm_rate = 0.001;
  double noise_margin = 2.0;
  double min_inlier_share = 0.5;
  int min_measurements = 100;

  void declare(ParameterSet& parameters);
};

/**
 * Accepts or refuses the refined estimate by its own covariance and residuals; never looks at ground truth.
 *
 * What is wanted of gravity, velocity and b_g must be predicted (judgePrediction()).
 *
 * Gyro, accelerometer and vision are judged each by the sum of its squared residuals: of a sum
 * r^T r with r ~ N(0, M), M = (I - H) over the sensor's residuals (NoiseCheck), mean and variance
 * are tr M and 2 tr M^2, those of (tr M^2 / tr M) times a chi-square variable of (tr M)^2 / tr M^2
 * degrees of freedom (Satterthwaite, Biometrics 1946). The bound is its quantile at the false-alarm
 * rate, times what the sum would grow by if this sensor's noise alone were `noise_margin` times
 * what is believed: the residuals hold the others' noise too. A bias is judged by its distance from
 * the prior's mean in the prior's standard deviations, three degrees of freedom, without a margin.
 */
Expected<void> judge(const VisualInertialBaResult& refined, const AcceptanceOptions& options);

/**
 * Whether the errors that a covariance predicts (predictedError()) are as small as wanted, at the
 * confidence wanted: of gravity's direction, of the last keyframe's velocity and of b_g. A refusal
 * names the worst axis of the body at the last keyframe, and the motion that would help.
 * @param covariance in the order of Initialization::covariance, not empty
 * @param R_WB attitude of the last keyframe
 */
Expected<void> judgePrediction(const Eigen::MatrixXd& covariance, const Eigen::Matrix3d& R_WB,
                               const AcceptanceOptions& options);

}  // namespace etalon
