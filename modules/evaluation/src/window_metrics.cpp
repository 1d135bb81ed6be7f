#include "etalon/evaluation/window_metrics.h"

#include <cmath>

#include "etalon/core/errors.h"

namespace etalon {

double WindowMetric::lastDigit() const { return std::pow(10.0, -decimals) / factor; }

std::vector<WindowMetric> windowMetrics() {
  using E = WindowErrors;
  return {
      {"rre_deg", "relative rotation error", "RRE [deg]", &E::rre_deg, 4},
      {"ate_m", "absolute trajectory error, aligned in SE(3)", "ATE [mm]", &E::ate_m, 2, 1e3},
      {"ate_yaw_m", "absolute trajectory error, aligned in yaw and position",
       "ATE in yaw and position [mm]", &E::ate_yaw_m, 2, 1e3},
      {"gravity_deg", "gravity direction", "gravity [deg]", &E::gravity_deg, 3},
      {"gravity_corrected_deg", "gravity direction, against gravity as the recording's IMU has it",
       "gravity, corrected [deg]", &E::gravity_corrected_deg, 3},
      {"velocity_mps", "velocity", "velocity [m/s]", &E::velocity_mps, 4},
      {"gyro_bias_rps", "gyroscope bias", "gyro bias [rad/s]", &E::gyro_bias_rps, 5},
      {"accel_bias_mps2", "accelerometer bias", "accel bias [m/s2]", &E::accel_bias_mps2, 4},
      {"scale_error", "scale", "scale error [%]", &E::scale_error, 3, 100.0},
  };
}

std::vector<WindowMetric> neesMetrics() {
  using E = WindowErrors;
  return {
      {"tilt_nees", "tilt", "NEES of tilt", &E::tilt_nees, 2},
      {"velocity_nees", "velocity of the last keyframe", "NEES of velocity", &E::velocity_nees, 2},
      {"gyro_bias_nees", "gyroscope bias", "NEES of gyro bias", &E::gyro_bias_nees, 2},
      {"accel_bias_nees", "accelerometer bias", "NEES of accel bias", &E::accel_bias_nees, 2},
  };
}

WindowMetric windowMetric(const std::string& key) {
  std::string known;
  for (const WindowMetric& metric : windowMetrics()) {
    if (metric.key == key) return metric;
    known += (known.empty() ? "" : ", ") + metric.key;
  }
  throw ConfigError("metric '" + key + "': expected one of " + known);
}

}  // namespace etalon
