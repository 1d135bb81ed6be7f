#pragma once

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"

namespace etalon {

/**
 * How far the data sheet's white-noise densities are to be believed. A flying platform vibrates;
 * its accelerometer is several times noisier than at rest (docs/noise.md gives the measurement
 * behind the defaults).
 */
struct ImuNoiseOptions {
  double gyro_noise_factor = 2.0;
  double accel_noise_factor = 6.0;

  void declare(ParameterSet& parameters);
  /** The densities to use: data sheet times factors. The random walks are left as they are. */
  ImuNoiseDensities apply(const ImuNoiseDensities& data_sheet) const;
};

}  // namespace etalon
