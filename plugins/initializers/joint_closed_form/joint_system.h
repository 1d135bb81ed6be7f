#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

#include "closed_form_motion.h"
#include "etalon/core/se3.h"
#include "etalon/initialization/initialization_problem.h"

namespace etalon::plugins {

/** The estimate after a pass, in V, the frame of the first body. */
struct JointEstimate {
  ImuBias bias;
  std::vector<SE3> T_VB;              ///< of every node
  std::vector<Eigen::Vector3d> v_VB;  ///< of every node, m/s; empty before the first pass
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  double sigma_gravity = 0.0;  ///< of gravity's weakest direction, rad
};

/**
 * The linear system of one pass. The unknowns are x = [v_0, b_g, b_a, g], with b_g and b_a as
 * changes of the biases. The poses are y = J x + c + n, where n is the IMU's noise of covariance
 * Sigma; the tracks give the information S, s on y. The system minimises
 *   (y - S^-1 s)^T (S^-1 + Sigma)^-1 (y - S^-1 s)  at n = 0,
 * and n then takes its most likely value.
 */
class JointSystem {
 public:
  /**
   * @param estimate the state at which the tracks' information was computed
   * @param imu_noise false: Sigma = 0, the IMU counts as exact
   * @param estimate_accel_bias false: b_a is the mean of its prior
   */
  JointSystem(const InitializationProblem& problem, const ClosedFormMotion& motion,
              const Eigen::MatrixXd& S, const Eigen::VectorXd& s, const JointEstimate& estimate,
              bool imu_noise, bool estimate_accel_bias);

  /** Solves with |g| fixed and updates `estimate`. @return false if the system is singular */
  bool solve(JointEstimate* estimate) const;

  /**
   * Covariance of the error at `estimate`, in the order and the world of
   * Initialization::covariance. S must be the tracks' Fisher information, not the robust
   * approximation of it.
   * @return empty if the system is singular
   */
  Eigen::MatrixXd covariance(const JointEstimate& estimate) const;

 private:
  double gravity_mps2_;
  bool imu_noise_;
  Eigen::MatrixXd S_;
  Eigen::VectorXd s_;
  Eigen::MatrixXd J9_;  ///< rows of every node's [rotation, position, velocity]
  Eigen::VectorXd c9_;
  Eigen::MatrixXd noise_y_;     ///< covariance of the poses' noise with the nodes' noise, 6n x 9n
  Eigen::MatrixXd last_noise_;  ///< covariance of the last node's velocity, 3 x 3
  Eigen::PartialPivLU<Eigen::MatrixXd> whitening_;  ///< I + S Sigma
  Eigen::MatrixXd W_;                               ///< (S^-1 + Sigma)^-1
  Eigen::MatrixXd H_;                               ///< information on x, priors included
  Eigen::VectorXd b_;
};

}  // namespace etalon::plugins
