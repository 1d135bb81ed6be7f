#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/steps/gyro_bias_errors.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon {

/**
 * What the errors of an initializer come from, as one vector with its covariance: the poses of
 * stereo odometry, the IMU's noise between keyframes, how far the biases are from their prior's
 * mean, and what a gyro bias measured elsewhere has besides the IMU's noise. The four are
 * independent of each other. Errors are estimate (or measurement) less truth; an error that depends
 * on them linearly is a matrix with a column for each.
 */
class ErrorSources {
 public:
  /**
   * @param preintegrations between neighbouring keyframes
   * @param measured_gyro_bias of a b_g found elsewhere; default: none
   */
  ErrorSources(const InitializationProblem& problem,
               const std::vector<Preintegration>& preintegrations,
               const GyroBiasErrors& measured_gyro_bias = {});
  /** The same with poses that are not stereo odometry's. @param poses their covariance */
  ErrorSources(const InitializationProblem& problem,
               const std::vector<Preintegration>& preintegrations, const Eigen::MatrixXd& poses,
               const GyroBiasErrors& measured_gyro_bias);

  /** Of keyframes 1.., [rotation, position] as VisualSolution::covariance: 6(N-1) rows. */
  Eigen::MatrixXd poses() const { return select(0, 6 * intervals_); }
  /** Of the preintegrations, [rotation, position, velocity]: 9(N-1) rows. */
  Eigen::MatrixXd imu() const { return select(6 * intervals_, 9 * intervals_); }
  /** Of the prior's mean, b_g and b_a: 6 rows. */
  Eigen::MatrixXd priorMean() const { return select(15 * intervals_, 6); }
  /** Of the b_g found elsewhere: 3 rows. */
  Eigen::MatrixXd measuredGyroBias() const;

  Eigen::MatrixXd covarianceOf(const Eigen::MatrixXd& errors) const {
    return errors * covariance_ * errors.transpose();
  }

 private:
  Eigen::MatrixXd select(Eigen::Index first, Eigen::Index rows) const;

  Eigen::Index intervals_;
  std::vector<Eigen::Matrix3d> gyro_bias_by_rotations_;
  Eigen::MatrixXd covariance_;
};

/** First-order errors of an estimate in V: rows [b_g (3), b_a (3), g_V (3), v_0 .. v_N-1 (in V)].
 */
struct StateErrors {
  static constexpr Eigen::Index kGyro = 0, kAccel = 3, kGravity = 6, kVelocity = 9;

  ErrorSources sources;
  Eigen::MatrixXd map;
  /** Of keyframes 1.., [rotation, position] in V: 6(N-1) rows; empty: not known. */
  Eigen::MatrixXd poses = {};

  /**
   * Initialization::covariance, with the poses where their errors are known.
   * @param v_WB of the last keyframe, in W
   */
  Eigen::MatrixXd covariance(const Eigen::Matrix3d& R_WV, const Eigen::Vector3d& v_WB,
                             double gravity_mps2) const;
};

/** Errors of the inertial-only MAP on the poses of stereo odometry; none if those have no
 * covariance. */
std::optional<StateErrors> inertialOnlyErrors(const InitializationProblem& problem,
                                              const std::vector<Preintegration>& preintegrations,
                                              const InertialOnlyOptions& options,
                                              const InertialOnlyResult& result,
                                              const GyroBiasErrors& measured_gyro_bias);

/**
 * Errors of a linear alignment's rows at its solution.
 * @param pose_errors 6(N-1) rows, [rotation, position] of keyframes 1..
 * @param bias_errors 6 rows, of the biases at which the rows stand
 */
Eigen::MatrixXd rowErrors(const LinearAlignmentRows& rows, const ErrorSources& sources,
                          const Eigen::MatrixXd& pose_errors, const Eigen::MatrixXd& bias_errors);

/**
 * Replaces the errors of gravity and velocities by those of a linear alignment.
 * @param T_VB its poses
 * @param pose_errors 6(N-1) rows, [rotation, position] of keyframes 1..
 * @param errors has those of the biases
 * @return false if the alignment is not determined
 */
bool alignErrors(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& preintegrations,
                 const ImuBias& bias, const LinearAlignmentOptions& options,
                 const Eigen::Vector3d& g_V, const Eigen::MatrixXd& pose_errors,
                 StateErrors* errors);

}  // namespace etalon
