#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/imu/preintegration.h"

namespace etalon::plugins {

/** Positions, velocities, gravity and accelerometer bias of a window whose rotations are known. */
struct LinearState {
  std::vector<Eigen::Vector3d> p, v;  ///< of the body in V, m and m/s
  Eigen::Vector3d g_V = Eigen::Vector3d::Zero();
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();
};

/**
 * The preintegrated positions and velocities as linear equations between neighbouring keyframes,
 *   R_k^T (p_k+1 - p_k - v_k dt - g dt^2/2) = dp(b_a),   R_k^T (v_k+1 - v_k - g dt) = dv(b_a),
 * whitened by their 6x6 covariance, with gravity on its sphere and a Gaussian prior on b_a.
 *
 * Order of the unknowns: p (3N), v (3N), gravity in its tangent plane (2), b_a (3).
 */
class ImuAlignment {
 public:
  /**
   * @param preintegrations N-1, integrated at `b_g` and the prior's mean of b_a
   * @param prior_sigma standard deviation of b_a, m/s^2; 0: b_a is held
   * @param held b_a stays at the prior's mean, however far it may be from that
   */
  ImuAlignment(const std::vector<Eigen::Matrix3d>& R_VB,
               const std::vector<Preintegration>& preintegrations, double gravity_mps2,
               const Eigen::Vector3d& prior_mean, double prior_sigma, bool held = false);

  Eigen::Index size() const { return 6 * R_VB_.size() + 5; }

  /** Integrates p and v from rest; gravity points against the sum of the velocity increments. */
  LinearState start() const;

  /** Adds Hessian and gradient of half the sum of squares at `state`. */
  void addTo(const LinearState& state, Eigen::MatrixXd* H, Eigen::VectorXd* gradient) const;

  double priorInformation() const;
  /** Variance of the gradient of addTo() by b_a that is the prior's: how far b_a is from its mean. */
  double priorScore() const;

  /**
   * How the sources of error reach the rotations and the gradient. The sources are the IMU's noise,
   * [rotation, position, velocity] of every interval, followed by the error of b_g.
   */
  struct NoiseResponse {
    Eigen::MatrixXd sources;    ///< covariance of the sources
    Eigen::MatrixXd rotations;  ///< d(rotations, right perturbation)/d(sources), 3N rows
    Eigen::MatrixXd gradient;   ///< d(gradient of addTo() at the true state)/d(sources)
  };
  NoiseResponse noiseResponse(const LinearState& state, const Eigen::Matrix3d& gyro_bias) const;

  LinearState moved(const LinearState& state, const Eigen::VectorXd& step) const;

 private:
  /** Residual and Jacobian of one interval, whitened. Columns: p_k, p_k+1, v_k, v_k+1, gravity,
   * b_a.
   */
  struct Rows {
    Eigen::Matrix<double, 6, 1> r;
    Eigen::Matrix<double, 6, 17> J;
    Eigen::Matrix<double, 6, 6> whitening;  ///< L^-1, the covariance of r being L L^T
  };
  Rows rowsOf(size_t k, const LinearState& state) const;

  const std::vector<Eigen::Matrix3d>& R_VB_;
  const std::vector<Preintegration>& preintegrations_;
  double gravity_mps2_;
  Eigen::Vector3d prior_mean_;
  double prior_sigma_;
  bool held_;
};

}  // namespace etalon::plugins
