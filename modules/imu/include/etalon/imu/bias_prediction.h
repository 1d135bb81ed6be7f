#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/time.h"

namespace etalon {

/** The bias of one sensor in one flight; rad/s or m/s^2, in B. */
struct SensorBias {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();   ///< over the flight
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< standard error of the mean
  double wander = 0.0;  ///< standard deviation about the mean within the flight, an axis
};

/** The biases of a device in one flight. */
struct FlightBias {
  TimeNs first = 0, last = 0;  ///< stamps between which they were estimated
  SensorBias gyro, accel;

  double seconds() const { return secondsBetween(first, last); }
};

/** Where the bias of a sensor will be in the device's next flight. */
struct BiasPrediction {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  /** Of a Gaussian about `mean` that covers an axis of the bias at an instant of the next flight: its
   * three sigmas hold as much of the predictive distribution as of itself, 99.73 %. The
   * distribution's own standard deviation would leave its tails out. */
  double sigma = 0.0;
  double spread = 0.0;        ///< between flights: scale of the t distribution, an axis
  double spread_sigma = 0.0;  ///< standard deviation of what is known of it
  double wander = 0.0;        ///< within a flight
};

/**
 * A random-effects model of the flights: mean_i = mu + d_i + e_i, with e_i of the flight's own
 * standard error and d_i from a three-dimensional Student t distribution of four degrees of freedom
 * and one scale for all axes, so that a flight that is far from the others moves mu and the scale
 * little (Lange, Little and Taylor, JASA 1989, who propose four where there is too little to
 * estimate it). The scale is integrated out over its posterior, with Gelman's prior for few groups
 * (half-Cauchy, Bayesian Analysis 2006) of the scale `wide`: a few flights hardly tell a spread, and
 * the prediction is wider for it. mu has a flat prior and is integrated out by its curvature. The
 * wander of the next flight is Gaussian, of the flights' mean variance. Tails are covered as
 * navigation covers those of its errors (DeCleene, ION GPS 2000), but at one level.
 *
 * @param wide standard deviation that is believed without any flight; the prediction has no more
 * @return for no flights: mean zero, sigma `wide`
 */
BiasPrediction predictBias(const std::vector<SensorBias>& flights, double wide);

/** Change of a bias with the date, an axis: least squares over the flights. */
struct BiasDrift {
  Eigen::Vector3d per_day = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< from the scatter about the line
  double days = 0.0;                                ///< from the first flight to the last
};

/** Nothing where stamps do not tell: fewer than four flights, a day or less between the first and
 * the last, or stamps that are no dates (before 2000). */
std::optional<BiasDrift> biasDrift(const std::vector<SensorBias>& flights,
                                   const std::vector<TimeNs>& stamps);

/** Whether stamps of this size are dates (after 2000), or count from some start. */
constexpr bool isDate(TimeNs stamp) { return stamp > 946'684'800 * kNanosecondsPerSecond; }

}  // namespace etalon
