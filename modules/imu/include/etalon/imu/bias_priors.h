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

  /** Squared exponential (Rasmussen and Williams, Gaussian Processes for Machine Learning, 4.2.1):
   * exp(-(apart / time)^2 / 2). */
  double correlation(double apart_s) const {
    const double x = apart_s / time_s;
    return std::exp(-0.5 * x * x);
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
