#pragma once

#include <limits>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/pipeline/frame_estimate.h"

namespace etalon {

/** The size of an error, and its predicted standard deviation; NaN where it is not known. */
struct ErrorAndSigma {
  double error = std::numeric_limits<double>::quiet_NaN();
  double sigma = std::numeric_limits<double>::quiet_NaN();
};

/**
 * Errors of a frame's estimate against ground truth beside what its covariance predicts. Position
 * and yaw count from the last start, as in the covariance: the ground truth's world is turned about
 * z and moved so that the pose of the last start is right. Vectors are given by their length, which
 * the root of the covariance's trace predicts.
 */
struct FlightErrors {
  ErrorAndSigma position_m, tilt_deg, yaw_deg, velocity_mps, gyro_bias_rps, accel_bias_mps2;
};

/** A figure of FlightErrors, for tables and charts. */
struct FlightFigure {
  const char* key;   ///< in the page's data
  const char* name;  ///< for people
  const char* unit;  ///< of `factor` times the value
  double factor;
  ErrorAndSigma FlightErrors::*member;
};
const std::vector<FlightFigure>& flightFigures();

/** The errors of each estimate. @param ground_truth may be empty */
std::vector<FlightErrors> flightErrors(const std::vector<FrameEstimate>& estimates,
                                       const GroundTruth& ground_truth);

}  // namespace etalon
