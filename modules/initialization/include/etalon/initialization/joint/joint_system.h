#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/initialization/initialization_problem.h"
#include "etalon/initialization/joint/closed_form_motion.h"
#include "etalon/optimization/variance_components.h"

namespace etalon {

/** What is known after a pass, in V, the frame of the first body. */
struct JointEstimate {
  ImuBias bias;
  std::vector<SE3> T_VB;  ///< of every node
  /** Of every node as the cameras see it, relative to the first as they see that: where the tracks'
   * information is taken. They differ from T_VB by the errors that the model has of the cameras. */
  std::vector<SE3> T_SS;
  Eigen::Matrix3d R_VS = Eigen::Matrix3d::Identity();  ///< of the first node as the cameras see it
  std::vector<Eigen::Vector3d> v_VB;  ///< of every node, m/s; empty before the first pass
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  double sigma_gravity = 0.0;  ///< of its weakest direction, rad
  /** Last step of T_SS in the tracks' standard deviations: root mean square over its components. */
  double step_sigmas = 0.0;
  /** Sizes of the accelerometer's errors in the window, over those of the model and of the
   * preintegrations. */
  AccelErrorSizes sizes;
};

/** What the linear system takes for exact, and what for noisy. */
struct JointModel {
  bool imu_noise = true;            ///< false: the IMU counts as exact
  bool estimate_accel_bias = true;  ///< false: b_a is the mean of its prior
  /** Of the error that all pixels of a node share, as a rotation an axis of the body, rad
   * (VisualInertialBaOptions::sigma_shared_deg). Only with `imu_noise`. */
  double sigma_shared_rad = 0.0;
  /** Of the turn of the cameras in the body against the calibration, an axis, rad
   * (VisualInertialBaOptions::sigma_turn_deg). Only with `imu_noise`. */
  double sigma_turn_rad = 0.0;
  /** The accelerometer's slow error. With one the sizes of both errors in the window are
   * estimated. */
  SlowAcceleration slow_accel;
};

/**
 * The linear system of one pass. The unknowns x = [v_0, b_g, b_a, g], changes of the biases, and
 * the tracks' information S, s on the poses y = J x + c + n, n the IMU's noise of covariance Sigma
 * (and what the cameras see turned), are joined by
 *   (y - S^-1 s)^T (S^-1 + Sigma)^-1 (y - S^-1 s)  at n = 0,   then n is what is most likely.
 */
class JointSystem {
 public:
  /**
   * @param estimate where the tracks' information was taken
   */
  JointSystem(const InitializationProblem& problem, const ClosedFormMotion& motion,
              const Eigen::MatrixXd& S, const Eigen::VectorXd& s, const JointEstimate& estimate,
              const JointModel& model);

  /** Solves with |g| fixed and takes `estimate` there, the sizes of the accelerometer's errors by one
   * step (scoredSizes()). @return false if the system is singular */
  bool solve(JointEstimate* estimate) const;

  /**
   * Covariance of the error, in the order and the world of Initialization::covariance, at
   * `estimate`. For S that is the tracks' curvature (TrackInformation::information()); what their
   * score has more is `excess`: with K = (I + S Sigma)^-1 it adds K excess K^T to the covariance of
   * the poses' gradient.
   * @param keyframes nodes whose poses are wanted, the first of them node 0
   * @return empty if the system is singular, or the cost has no minimum there
   */
  Eigen::MatrixXd covariance(const JointEstimate& estimate, const std::vector<size_t>& keyframes,
                             const Eigen::MatrixXd& excess = {}) const;

 private:
  /** @param x the solution */
  void followSizes(const Eigen::VectorXd& x, JointEstimate* estimate) const;
  /** Gravity moves in its tangent plane: 12 unknowns by 11. */
  Eigen::MatrixXd tangent(const Eigen::Vector3d& g) const;

  double gravity_mps2_;
  bool imu_noise_;
  Eigen::MatrixXd S_;
  Eigen::VectorXd s_;
  Eigen::MatrixXd J9_;  ///< of every node's [rotation, position, velocity]
  Eigen::VectorXd c9_;
  Eigen::MatrixXd noise_y_;  ///< covariance of the poses' noise and all nodes', 6n x 9n
  Eigen::MatrixXd noise_;    ///< covariance of all nodes' noise, 9n x 9n
  Eigen::MatrixXd sigma_;    ///< Sigma
  /** Covariance of the first node's turn and the poses as they are seen, 3 x 6n. */
  Eigen::MatrixXd first_seen_;
  SlowAcceleration slow_accel_;
  Eigen::MatrixXd slow_;        ///< what of Sigma the slow error makes; empty without
  Eigen::MatrixXd white_root_;  ///< ClosedFormMotion::white_accel_root
  Eigen::PartialPivLU<Eigen::MatrixXd> whitening_;  ///< I + S Sigma
  Eigen::MatrixXd W_;                               ///< (S^-1 + Sigma)^-1
  Eigen::MatrixXd H_;                               ///< information on x, priors included
  Eigen::VectorXd b_;
};

}  // namespace etalon
