#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "etalon/imu/bias_priors.h"
#include "etalon/imu/preintegration.h"

namespace etalon {

/**
 * Motion of a window as a linear function of its first velocity and gravity, in V, the frame of the
 * first body (Martinelli, IJCV 2014; Dong-Si and Mourikis, IROS 2012):
 *   R_VBk = dR_1 .. dR_k,   p_k = v_0 t_k + g t_k^2 / 2 + alpha_k,   v_k = v_0 + g t_k + beta_k,
 * with the derivatives by the biases and the covariance that the IMU's noise adds up to.
 */
struct ClosedFormMotion {
  static constexpr int kError = 9;  ///< error of a node: [rotation, position, velocity]

  struct Node {
    double t = 0.0;  ///< s after the first
    Eigen::Matrix3d R_VB = Eigen::Matrix3d::Identity();
    Eigen::Vector3d alpha = Eigen::Vector3d::Zero();  ///< m
    Eigen::Vector3d beta = Eigen::Vector3d::Zero();   ///< m/s
    /** d[rotation (right perturbation), alpha, beta] / d[b_g, b_a]. */
    Eigen::Matrix<double, kError, 6> bias = Eigen::Matrix<double, kError, 6>::Zero();
  };
  std::vector<Node> nodes;
  /** Joint covariance of the nodes' errors but the first's, 9(N-1) x 9(N-1). */
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd slow_covariance;  ///< what of it the slow error makes; empty without
  /** A root of what of the positions' the accelerometer's white noise makes: 6 columns an interval,
   * 3(N-1) x 6(N-1). */
  Eigen::MatrixXd white_accel_root;
};

/**
 * @param preintegrations between neighbouring nodes
 * @param slow adds to the covariance; constant over an interval
 * @param white_accel times the accelerometer's white noise of the preintegrations, an interval each;
 *        empty: 1
 * @param bias of the result, to first order (Preintegration::corrected()); without, that of the
 *        preintegrations
 */
ClosedFormMotion composeMotion(const std::vector<Preintegration>& preintegrations,
                               const SlowAcceleration& slow = {},
                               const Eigen::VectorXd& white_accel = {},
                               const std::optional<ImuBias>& bias = std::nullopt);

}  // namespace etalon
