#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

/** A gyro bias found elsewhere: rad/s, and its information, 1/(rad/s)^2; zero: a start alone. */
struct GyroBiasMeasurement {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

struct InertialOnlyOptions {
  double prior_gyro_information = 1e2;   ///< 1/(rad/s)^2: sigma 0.1 rad/s
  double prior_accel_information = 1e5;  ///< 1/(m/s^2)^2: sigma 3.2e-3 m/s^2
  ImuBias prior_mean;
  std::optional<GyroBiasMeasurement> gyro_bias;  ///< besides the prior; the iterations start there
  double gravity_mps2 = 9.81;
  int max_iterations = 200;
};

struct InertialOnlyResult {
  SolverSummary summary;
  Eigen::Vector3d g_V;                ///< gravity in the poses' frame, m/s^2
  std::vector<Eigen::Vector3d> v_VB;  ///< one a keyframe, in V, m/s
  ImuBias bias;
  /** Covariance of [b_g, b_a, gravity direction (2)], 8x8, from the Gauss-Newton information; empty
   * if singular. */
  Eigen::MatrixXd covariance;
  double smallest_eigenvalue_gravity =
      0.0;  ///< of the gravity direction's information (marginal), 1/rad^2
};

/**
 * The inertial-only MAP (Campos et al., ICRA 2020, with scale 1 for stereo): poses fixed;
 * velocities, one gyro and one accelerometer bias and the direction of gravity are found from the
 * preintegrated measurements and Gaussian bias priors.
 *
 * Residual per pair: PreintegrationResidual whitened by its 9x9 covariance; no robust loss.
 * Levenberg-Marquardt on dense normal equations; gravity moves on the sphere of radius
 * `gravity_mps2`. Seeds: gravity along minus the sum of R_VB(k-1) dv_k, velocities from finite
 * differences, biases from the prior mean.
 *
 * @param T_VB poses of N >= 2 keyframes
 * @param preintegrations N-1, between neighbours
 */
InertialOnlyResult solveInertialOnlyMap(const std::vector<SE3>& T_VB,
                                        const std::vector<Preintegration>& preintegrations,
                                        const InertialOnlyOptions& options = {});

/** How the MAP's solution [b_g, b_a, gravity direction (2), v_0 .. v_N-1] answers to what goes in,
 * to first order. Empty where the system is singular. */
struct InertialOnlyResponse {
  Eigen::MatrixXd by_residuals;        ///< (8 + 3N) x 9(N-1), of the pairs as they are, unwhitened
  Eigen::MatrixXd residuals_by_poses;  ///< 9(N-1) x 6(N-1), [rotation, position] of keyframes 1..
  Eigen::MatrixXd by_prior_mean;       ///< (8 + 3N) x 6, b_g and b_a
  Eigen::MatrixXd by_gyro_bias;        ///< (8 + 3N) x 3, of InertialOnlyOptions::gyro_bias
};

/** At `result`, which solveInertialOnlyMap() returned for the same arguments. */
InertialOnlyResponse inertialOnlyResponse(const std::vector<SE3>& T_VB,
                                          const std::vector<Preintegration>& preintegrations,
                                          const InertialOnlyOptions& options,
                                          const InertialOnlyResult& result);

}  // namespace etalon
