#pragma once

#include <cmath>

#include "etalon/imu/preintegration.h"

namespace etalon {

/**
 * How an accelerometer's error strays from its bias within a window: a smooth stationary Gaussian
 * process an axis of the body. What vibration and scale leave is not white: it changes as the motion
 * does (docs/noise.md), so that neighbouring quarters of a second err nearly alike.
 */
struct SlowAcceleration {
  double sigma_mps2 = 0.0;  ///< standard deviation, m/s^2; 0: none
  double time_s = 0.68;     ///< of correlation
  /** Share of the accelerometer's noise density that is white where there is a slow error beside it:
   * inflated densities stand for both. */
  double white_share = 0.33;
  /** Both sizes differ between windows: standard deviations of the logarithms of their variances. 0:
   * the size is as above. */
  double spread = 1.0, white_spread = 0.5;
  /** The same of the white noise of single intervals between keyframes, which may have more than the
   * window. 0: none has. */
  double jolt_spread = 2.0;

  /** Squared exponential (Rasmussen and Williams, Gaussian Processes for Machine Learning, 4.2.1):
   * exp(-(apart / time)^2 / 2). */
  double correlation(double apart_s) const {
    const double x = apart_s / time_s;
    return std::exp(-0.5 * x * x);
  }

  /** What of densities that stand for both errors is white. */
  ImuNoiseDensities white(ImuNoiseDensities both) const {
    if (sigma_mps2 > 0.0) both.accel_noise_density *= white_share;
    return both;
  }
};

/** What is believed of the biases before any measurement: Gaussian, isotropic. Section [priors]. */
struct BiasPriors {
  ImuBias mean;
  double sigma_gyro_rps = 0.1;    ///< rad/s
  double sigma_accel_mps2 = 0.1;  ///< m/s^2
  SlowAcceleration slow_accel;    ///< around b_a
};

}  // namespace etalon
