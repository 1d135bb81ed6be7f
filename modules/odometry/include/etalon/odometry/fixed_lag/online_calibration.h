#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "etalon/core/parameters.h"

namespace etalon {

/** What an odometry does about a part of the calibration that it was given. */
enum class CalibrationMode {
  kOff,   ///< takes it as exact
  kOn,    ///< follows its own estimate as soon as the odometry has settled
  kAuto,  ///< estimates it, and uses the estimate only where the calibration is certainly wrong
};

/** A time offset farther from what was given is not believed, s: five standard deviations of what is
 * believed before any measurement. */
constexpr double kFarthestTimeOffset = 0.025;

/** Keys of section [odometry]. */
struct CalibrationOptions {
  CalibrationMode time_offset = CalibrationMode::kAuto;
  CalibrationMode extrinsics = CalibrationMode::kAuto;
  CalibrationMode intrinsics = CalibrationMode::kAuto;
  /** Standard deviation of the accelerometer's scale factor, by which the baseline is measured. */
  double accel_scale_sigma = 0.005;
  /** The same of the gyro, by which the focal lengths are measured. */
  double gyro_scale_sigma = 0.01;

  void declare(ParameterSet& parameters);
  bool any() const {
    return time_offset != CalibrationMode::kOff || extrinsics != CalibrationMode::kOff ||
           intrinsics != CalibrationMode::kOff;
  }
};

/** What an odometry says of one quantity of the calibration. */
struct CalibrationFinding {
  enum class Verdict {
    kNotObserved,  ///< the flight told hardly more than was believed before
    kAgrees,       ///< with what was given, as far as the flight can tell
    kOff,          ///< certainly
    kImplausible,  ///< farther off than a calibration can be: not believed
  };

  std::string group;             ///< the key: "time_offset", "extrinsics", "intrinsics"
  std::string quantity;          ///< e.g. "baseline"
  std::string unit;              ///< of the numbers, e.g. "%"
  Eigen::VectorXd value;         ///< the deviation from what was given
  Eigen::VectorXd sigma;         ///< its standard deviations, widened (docs/odometry.md)
  Eigen::VectorXd formal_sigma;  ///< were all errors independent, as the equations have it
  Eigen::VectorXd used;          ///< what of it the odometry uses
  Verdict verdict = Verdict::kNotObserved;
  std::string words;  ///< a sentence without its full stop
};

/** Lower-case name as it stands in files, e.g. "not_observed". */
const char* toString(CalibrationFinding::Verdict verdict);

}  // namespace etalon
