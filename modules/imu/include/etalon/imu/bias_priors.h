#pragma once

#include "etalon/imu/preintegration.h"

namespace etalon {

/** What is believed of the biases before any measurement: Gaussian, isotropic. Section [priors]. */
struct BiasPriors {
  ImuBias mean;
  double sigma_gyro_rps = 0.1;    ///< rad/s
  double sigma_accel_mps2 = 0.1;  ///< m/s^2
};

}  // namespace etalon
