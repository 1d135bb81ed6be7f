#pragma once

#include "etalon/imu/preintegration.h"

namespace etalon {

/**
 * How an accelerometer's error strays from its bias within a window: a first-order Gauss-Markov
 * process an axis of the body. What vibration and scale leave is not white: over a tenth of a second
 * it is smaller than over two.
 */
struct SlowAcceleration {
  double sigma_mps2 = 0.0;  ///< standard deviation, m/s^2; 0: none
  double time_s = 1.0;      ///< of correlation
};

/** What is believed of the biases before any measurement: Gaussian, isotropic. Section [priors]. */
struct BiasPriors {
  ImuBias mean;
  double sigma_gyro_rps = 0.1;    ///< rad/s
  double sigma_accel_mps2 = 0.1;  ///< m/s^2
  SlowAcceleration slow_accel;    ///< around b_a
};

}  // namespace etalon
