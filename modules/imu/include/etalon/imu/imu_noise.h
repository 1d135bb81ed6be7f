#pragma once

#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * The white-noise density of a sensor that the samples themselves show, in its unit by sqrt(Hz),
 * mean over the axes. It comes from third differences: their variance is 20 times that of a white
 * sample, and motion that is slow against the sampling hardly enters. Vibration counts as noise.
 *
 * The first and the last sample are left out, because they may be interpolated, and so are those
 * around a gap. Infinite if fewer than 20 differences remain.
 * @param sensor &ImuSample::gyro or &ImuSample::accel
 */
double shownNoiseDensity(const std::vector<ImuSample>& samples, Eigen::Vector3d ImuSample::*sensor);

/** Random walks are no smaller: with zero, as some data sheets have it, a covariance of the motion is
 * singular. A hundredth of a good MEMS sensor's; over an hour the biases move by 6e-6 rad/s and 6e-5
 * m/s^2. */
constexpr double kLeastGyroRandomWalk = 1e-7;   // rad/s^2/sqrt(Hz)
constexpr double kLeastAccelRandomWalk = 1e-6;  // m/s^3/sqrt(Hz)

/**
 * How far the data sheet's white-noise densities are to be believed. A platform that vibrates has
 * an IMU several times noisier than one whose motors are off (docs/noise.md gives the measurements
 * behind the defaults).
 */
struct ImuNoiseOptions {
  double gyro_noise_factor = 2.2;       ///< of a platform that vibrates
  double min_gyro_noise_factor = 1.0;   ///< of one that does not
  double accel_noise_factor = 6.0;      ///< of a platform that vibrates
  double min_accel_noise_factor = 3.0;  ///< of one that does not

  void declare(ParameterSet& parameters);
  /** The densities to use on a platform that vibrates: data sheet times factors. The random walks
   * are left as they are, but for those below kLeastGyroRandomWalk and kLeastAccelRandomWalk. */
  ImuNoiseDensities apply(const ImuNoiseDensities& data_sheet) const;
  /**
   * The densities to use for a window. A sensor's is what the window's samples show, but no less
   * than the data sheet's times its least factor and no more than the data sheet's times the factor
   * of a platform that vibrates: most of a vibration integrates to nothing.
   */
  ImuNoiseDensities apply(const ImuNoiseDensities& data_sheet,
                          const std::vector<ImuSample>& window) const;
};

}  // namespace etalon
