#pragma once

#include <string>

#include "etalon/core/parameters.h"
#include "etalon/initialization/initialization_result.h"
#include "etalon/optimization/visual_inertial_ba.h"

namespace etalon {

/** Section [acceptance]: when an initialization, refined by VI-BA, is good enough to start the
 * odometry. */
struct AcceptanceOptions {
  double max_sigma_gravity_deg = 1.0;
  double max_sigma_velocity_mps = 0.1;
  double max_gyro_bias_rps = 0.3;
  double max_accel_bias_mps2 = 1.0;
  double max_chi2_per_dof_inertial = 5.0;
  double min_inlier_share = 0.5;
  int min_measurements = 100;

  void declare(ParameterSet& parameters);
};

struct AcceptanceDecision {
  bool accepted = false;
  InitializationStatus status = InitializationStatus::kNotConverged;
  std::string reason;  ///< one sentence with the number and its bound; empty if accepted
  double value = 0.0;
};

/** Judges the refined estimate by its own covariance and residuals; never looks at ground truth. */
AcceptanceDecision judge(const VisualInertialBaResult& refined, const AcceptanceOptions& options);

}  // namespace etalon
