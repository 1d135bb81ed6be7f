#pragma once

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
 * part); `vision` the pixels. Leverages J P J^T come from the joint covariance P of the fit; vision
 * has what remains of the parameters after the inertial residuals, the bias priors and the gauge.
 *
 * Residuals in the robust tail: an inertial residual beyond the Huber width (weight w < 1) enters
 * chi2 and dof with w^2, so that the former's share is bounded and the latter's vanishes; with
 * Gaussian noise believed right that moves chi2/dof by less than 1 %. Pixels are the inliers;
 * `vision.chi2` is dof times their variance by maximum likelihood for a Gaussian that is truncated
 * at the inlier threshold. Both are meant for noise that is right to a factor of two; where it is
 * not, chi2/dof says too little, and iteration (noise_calibration.h) finds the factor.
 *
 * The biases are constants of the window: their random walk within it counts as noise of the group.
 */
struct NoiseCheck {
  ResidualGroup gyro, accel, vision;

  NoiseCheck& operator+=(const NoiseCheck& other) {
    gyro += other.gyro;
    accel += other.accel;
    vision += other.vision;
    return *this;
  }
};

}  // namespace etalon
