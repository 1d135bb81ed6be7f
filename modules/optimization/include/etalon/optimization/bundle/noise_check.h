#pragma once

#include <Eigen/Core>

namespace etalon {

/** Sum of squared whitened residuals, and what is expected of it if the noise is believed right. */
struct ResidualGroup {
  double chi2 = 0.0;
  /** Number of residuals less what the fit takes out of them: trace of (I - H) over the group, with
   * H the hat matrix of the whitened problem. */
  double dof = 0.0;

  ResidualGroup& operator+=(const ResidualGroup& other) {
    chi2 += other.chi2;
    dof += other.dof;
    return *this;
  }
};

/**
 * Residuals of a visual-inertial estimate by the sensor that they speak of. Sums over windows.
 *
 * `gyro` are the rotation rows of the inertial residuals, whitened alone; `accel` the position and
 * velocity rows given the rotation's (conditional covariance, of which the gyro's noise is a small
 * part); `vision` the pixels at the noise in use, from the poses that the cameras see: those of the body turned by the
 * error that all pixels of a keyframe share (`[vi_ba] sigma_shared_deg`), which is part of the
 * noise in use. Leverages J P J^T come from the joint covariance P of the fit, shared errors
 * eliminated; vision has what remains of the parameters after the inertial residuals, the bias
 * priors and the gauge. Its dof holds that of the shared errors themselves, at most three a
 * keyframe.
 *
 * Robust losses. An inertial residual counts whole, however far off it is and however little the
 * fit heeds it: what Huber's loss bends to is what a check of the noise is to find. A pixel's squared
 * residual is clipped at the inlier threshold, outliers count as clipped; `vision.chi2` is dof times
 * the variance whose Gaussian, clipped alike, has their mean (Huber's proposal 2). The fit uses the
 * inliers alone: the inertial groups expect of the pixels only the noise that truncation leaves (at
 * 95 %, 0.84 of the variance).
 *
 * A group's residuals hold the noise of the others too: where the fit takes much out of a group,
 * its chi2/dof moves far less than the square of the factor by which its own noise is believed
 * wrong. `coupling` says how far, and estimateNoiseFactors() (noise_calibration.h) solves for it.
 *
 * The biases are constants of the window: their random walk within it counts as noise of the group.
 */
struct NoiseCheck {
  ResidualGroup gyro, accel, vision;
  /** E[chi2] = coupling * (true variance over believed variance), order gyro, accel, vision: traces
   * of (I - H)_gh (I - H)_hg, the matrix of Helmert's variance component estimation. Rows sum to
   * the dof. */
  Eigen::Matrix3d coupling = Eigen::Matrix3d::Zero();

  NoiseCheck& operator+=(const NoiseCheck& other) {
    gyro += other.gyro;
    accel += other.accel;
    vision += other.vision;
    coupling += other.coupling;
    return *this;
  }
};

}  // namespace etalon
