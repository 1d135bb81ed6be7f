#include "etalon/imu/imu_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace etalon {

double shownNoiseDensity(const std::vector<ImuSample>& samples,
                         Eigen::Vector3d ImuSample::*sensor) {
  constexpr int kFewest = 20;         // differences: 17 % of standard error in the density
  constexpr double kLongest = 1.5;    // step, in shortest ones of the same difference
  constexpr double kVariance = 20.0;  // of a third difference of white noise: 1 + 9 + 9 + 1
  double sum = 0.0;                   // the sensor's unit squared, by Hz
  int count = 0;
  for (size_t k = 1; k + 4 < samples.size(); ++k) {
    double shortest = std::numeric_limits<double>::infinity(), longest = 0.0;
    for (size_t i = k; i < k + 3; ++i) {
      const double step = secondsBetween(samples[i].t, samples[i + 1].t);
      shortest = std::min(shortest, step);
      longest = std::max(longest, step);
    }
    if (longest > kLongest * shortest) continue;
    const Eigen::Vector3d difference = samples[k + 3].*sensor - samples[k].*sensor -
                                       3.0 * (samples[k + 2].*sensor - samples[k + 1].*sensor);
    const double step = secondsBetween(samples[k].t, samples[k + 3].t) / 3.0;
    sum += difference.squaredNorm() / 3.0 / kVariance * step;
    ++count;
  }
  return count < kFewest ? std::numeric_limits<double>::infinity() : std::sqrt(sum / count);
}

namespace {

/** What the samples show, no less than the data sheet's times `least` and no more than `used`. */
double densityOf(const std::vector<ImuSample>& samples, Eigen::Vector3d ImuSample::*sensor,
                 double data_sheet, double least, double used) {
  return std::min(used, std::max(shownNoiseDensity(samples, sensor), least * data_sheet));
}

}  // namespace

void ImuNoiseOptions::declare(ParameterSet& parameters) {
  parameters.add("gyro_noise_factor", &gyro_noise_factor, {0.1, 1000.0},
                 "The gyro's white-noise density is the data sheet's times this factor where a "
                 "window's samples show vibration (a flying platform), and always in the odometry "
                 "after the start.");
  parameters.add("min_gyro_noise_factor", &min_gyro_noise_factor, {0.1, 1000.0},
                 "Where they show less than gyro_noise_factor, the density is what they show, but "
                 "no less than the data sheet's times this factor. At gyro_noise_factor or above, "
                 "gyro_noise_factor is always used.");
  parameters.add("accel_noise_factor", &accel_noise_factor, {0.1, 1000.0},
                 "As gyro_noise_factor, of the accelerometer.");
  parameters.add("min_accel_noise_factor", &min_accel_noise_factor, {0.1, 1000.0},
                 "As min_gyro_noise_factor, of the accelerometer.");
}

ImuNoiseDensities ImuNoiseOptions::apply(const ImuNoiseDensities& data_sheet) const {
  ImuNoiseDensities used = data_sheet;
  used.gyro_noise_density *= gyro_noise_factor;
  used.accel_noise_density *= accel_noise_factor;
  used.gyro_random_walk = std::max(used.gyro_random_walk, kLeastGyroRandomWalk);
  used.accel_random_walk = std::max(used.accel_random_walk, kLeastAccelRandomWalk);
  return used;
}

ImuNoiseDensities ImuNoiseOptions::apply(const ImuNoiseDensities& data_sheet,
                                         const std::vector<ImuSample>& window) const {
  ImuNoiseDensities used = apply(data_sheet);
  used.gyro_noise_density = densityOf(window, &ImuSample::gyro, data_sheet.gyro_noise_density,
                                      min_gyro_noise_factor, used.gyro_noise_density);
  used.accel_noise_density = densityOf(window, &ImuSample::accel, data_sheet.accel_noise_density,
                                       min_accel_noise_factor, used.accel_noise_density);
  return used;
}

}  // namespace etalon
