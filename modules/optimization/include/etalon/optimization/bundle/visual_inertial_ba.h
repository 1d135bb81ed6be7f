#pragma once

#include <string>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/imu/preintegration.h"
#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/optimization/bundle/visual_window.h"

namespace etalon {

/** Section [vi_ba]. */
struct VisualInertialBaOptions {
  int rounds = 2;  ///< optimise, relabel outliers and re-integrate, optimise again
  int iterations_per_round = 50;
  /** Converged is what stopped by a Gauss-Newton step shorter than this in its own sigmas. */
  double converged_sigmas = 0.1;
  double huber_inertial = 16.92;  ///< chi-square, 9 degrees of freedom; its root is the Huber width
  double huber_pixel = kChi2Pixel;
  ImuBias prior_mean;
  double prior_sigma_gyro_rps = 0.1;
  double prior_sigma_accel_mps2 = 0.1;
  /** Of the error that all pixels of a keyframe share, as a rotation an axis. Without it any number
   * of pixels would average out to nothing, and overrule the gyro. */
  double sigma_shared_deg = 0.012;
  double gravity_mps2 = 9.81;
  double reintegrate_gyro_rps = 0.01;   ///< re-integrate the raw samples if b_g moved farther
  double reintegrate_accel_mps2 = 0.1;  ///< the same for b_a
  bool compute_covariance = true;

  void declare(ParameterSet& parameters);
};

struct VisualInertialState {
  SE3 T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
};

struct VisualInertialBaResult {
  bool converged = false;  ///< last_step_sigmas is below VisualInertialBaOptions::converged_sigmas
  /** Length of the last step of all states together by the inverse covariance, that is the root of
   * twice the decrease that it promised. */
  double last_step_sigmas = 0.0;
  std::string message;  ///< why it failed; empty otherwise
  std::vector<VisualInertialState> states;
  ImuBias bias;
  std::vector<Eigen::Vector3d> landmarks;  ///< p_W; at kFarthestLandmark those at infinity
  std::vector<char> landmark_valid;
  std::vector<char> inlier;
  int iterations = 0;
  double chi2_visual = 0.0;  ///< over the inliers
  int dof_visual = 0;        ///< their number less the landmarks' unknowns
  int inlier_measurements = 0, measurements = 0;
  /** Distance of a bias from its prior's mean in the prior's standard deviations. */
  double gyro_bias_sigmas = 0.0, accel_bias_sigmas = 0.0;
  NoiseCheck noise;  ///< residuals against their expectation; zero without covariance
  /**
   * Covariance of every keyframe's [rotation, position, velocity] and then [b_g, b_a]: (9N+6)
   * square, gauge (position and yaw of the first keyframe) fixed. Far landmarks count for what they
   * tell and not for their noise (docs/theory.md, step 4). Empty if not computed or if the data do
   * not determine the state.
   */
  Eigen::MatrixXd covariance;

  /** Standard deviation of the tilt of the first keyframe, the larger of the two axes, rad;
   * infinite without covariance. */
  double sigmaTilt() const;
  /** Largest standard deviation of a component of the last keyframe's velocity, m/s; infinite
   * without covariance. */
  double sigmaVelocity() const;
};

/**
 * Visual-inertial bundle adjustment over a window, step 4: keyframe poses, velocities, one b_g, one
 * b_a, landmarks. W is gravity-aligned; gauge: position and yaw of the first keyframe. Ceres,
 * Levenberg-Marquardt, dense Schur complement, one thread, bit-identical from run to run.
 */
VisualInertialBaResult solveVisualInertialBa(const VisualWindow& window,
                                             const std::vector<Preintegration>& preintegrations,
                                             const std::vector<VisualInertialState>& states,
                                             const ImuBias& bias,
                                             const std::vector<Eigen::Vector3d>& landmarks,
                                             const std::vector<char>& landmark_valid,
                                             const VisualInertialBaOptions& options = {});

}  // namespace etalon
