#pragma once

#include <array>

#include "etalon/core/camera_model.h"
#include "etalon/core/se3.h"

namespace etalon {

/** Continuous-time noise densities of an IMU, as EuRoC's sensor.yaml gives them. */
struct ImuNoiseDensities {
  double gyro_noise_density = 1.6968e-4;  ///< rad/s/sqrt(Hz)
  double gyro_random_walk = 1.9393e-5;    ///< rad/s^2/sqrt(Hz)
  double accel_noise_density = 2.0e-3;    ///< m/s^2/sqrt(Hz)
  double accel_random_walk = 3.0e-3;      ///< m/s^3/sqrt(Hz)
};

struct CameraCalibration {
  CameraModel model;
  SE3 T_BC;               ///< camera to body (IMU)
  double rate_hz = 20.0;  ///< nominal
};

struct ImuCalibration {
  ImuNoiseDensities noise;
  double rate_hz = 200.0;  ///< nominal
};

/** Everything known about the rig before a run. Camera 0 is the left one. */
struct StereoInertialCalibration {
  std::array<CameraCalibration, 2> cameras;
  ImuCalibration imu;

  /** T_C1C0: left camera frame to right camera frame. */
  SE3 rightFromLeft() const { return cameras[1].T_BC.inverse() * cameras[0].T_BC; }
  /** Distance between the two camera centres, m. */
  double baseline() const { return (cameras[0].T_BC.t - cameras[1].T_BC.t).norm(); }
};

}  // namespace etalon
