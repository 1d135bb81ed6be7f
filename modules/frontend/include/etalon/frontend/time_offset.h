#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "etalon/datasets/recorded_source.h"
#include "etalon/datasets/recording_checks.h"
#include "etalon/datasets/recording_info.h"

namespace etalon {

/** Rotation of the left camera between two of its images, measured in the images alone. */
struct RotationStep {
  TimeNs t0 = 0, t1 = 0;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< Log(R_C(t0)C(t1)), rad
};

/** How the gyro's and the camera's clocks agree: the camera's stamp t shows the motion of the
 * gyro's stamp t + offset. */
struct TimeOffsetEstimate {
  bool estimated = false;
  std::string reason;  ///< why not, or why the estimate is not clear
  bool clear = false;  ///< one high, single peak: the figures can be relied on
  double offset_s = 0;
  /** Its standard deviation by the curvature of the peak, s: errors of the camera's rotations taken
   * as independent, so a lower bound. */
  double sigma_s = 0;
  double correlation = 0;          ///< of the two rotations at the peak, in [-1, 1]
  double correlation_at_zero = 0;  ///< without offset
  double runner_up = 0;            ///< highest other peak
  /** Highest one with the camera turned in the body as the calibration has it. */
  double correlation_as_given = -1;
  double correlation_mirrored = 0;  ///< highest one with an axis of the gyro inverted
  double gyro_spread_rad = 0;       ///< of the gyro's rotations from image to image, at the peak
  double gyro_scale =
      0;  ///< gyro's rotation over the camera's at the peak; 57.3 for a gyro in deg/s
  /** R_CB that turns the gyro's rotations into the camera's; nothing unless they span two axes at
   * least. */
  std::optional<Eigen::Matrix3d> R_CB;
  int steps = 0;  ///< pairs of images used

  /** Whether the offset explains more than none does. */
  bool discernible() const;
};

/**
 * Measures the rotation between consecutive left images (KLT, essential matrix on undistorted
 * bearings) where the gyro moves most, decoding at most `max_frames` images. Images that cannot be
 * read or tracked give no step; the former are entered in `problems` where it is given.
 */
std::vector<RotationStep> measureCameraRotation(RecordedSource& source, size_t max_frames,
                                                ImageProblems* problems = nullptr);

/**
 * The offset at which gyro and camera correlate best, within +-`max_offset_s`: for every offset the
 * means are removed (and with them the gyro's bias), the gyro's rotations are turned into the
 * camera's frame by the best rotation (orthogonal Procrustes), and the two are correlated. So
 * neither wrong extrinsics nor a wrong unit of the gyro matters.
 * @param given_R_CB what the calibration says, of which correlation_as_given is
 */
TimeOffsetEstimate estimateTimeOffset(const std::vector<RotationStep>& steps,
                                      const std::vector<ImuSample>& imu, double max_offset_s,
                                      const Eigen::Matrix3d& given_R_CB);

/** Angle between R_BC0 of the calibration and the one that gyro and images say, deg; only where the
 * two correlate and turn about two axes. */
std::optional<double> rotationDisagreementDeg(const TimeOffsetEstimate& offset,
                                              const StereoInertialCalibration& calibration);

/**
 * What gyro and images together say is wrong with a recording: the rotation of the camera to the
 * IMU, the gyro's unit and axes, the clocks.
 * @param image_rate_hz offsets of less than half a period are not worth a warning
 */
RecordingFindings checkMotion(const TimeOffsetEstimate& offset,
                              const StereoInertialCalibration& calibration, double image_rate_hz);

}  // namespace etalon
