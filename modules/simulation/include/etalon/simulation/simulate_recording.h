#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "etalon/core/calibration.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/stereo_renderer.h"

namespace etalon {

struct SimulationOptions {
  std::string output;      ///< folder to write
  bool overwrite = false;  ///< what a simulation writes, if the folder is not empty

  std::uint64_t seed = 1;  ///< of everything: motion, biases, noise, room, textures
  MotionProfile profile = MotionProfile::kGentle;
  /** Time from the first image to the end, s; without, 30 s for a profile and all of a recorded
   * flight. */
  std::optional<double> duration_s;

  std::string trajectory_file;  ///< a recorded ground truth to fly instead of a profile (EuRoC's 8
                                ///< or 17 columns)
  std::string
      imu_file;  ///< a recorded IMU to copy instead of a synthetic one; needs `trajectory_file`
  std::string stamps_file;  ///< image stamps, one a line; needs `trajectory_file`
  double from_s = 0.0;      ///< of a recorded flight: images from this time after its first row on

  StereoInertialCalibration calibration = eurocCalibration();
  RenderOptions render;   ///< its seed is replaced by `seed`
  double gravity = 9.81;  ///< m/s^2
  /**
   * Neither noise nor biases in IMU and images. The flight of a profile is then an
   * IntegratedTrajectory, so that preintegration between image stamps agrees with the
   * ground truth to rounding.
   */
  bool noise_free = false;

  int threads =
      0;  ///< that render; 0: as many as the machine has. The result does not depend on it.
  /** Called after every stereo frame with the number of frames done and of all; never twice at a
   * time. */
  std::function<void(int done, int all)> progress;
};

struct SimulationSummary {
  int stereo_frames = 0;
  int imu_samples = 0;
  int skipped_stamps = 0;  ///< of the stamps file: outside of the ground truth, of the IMU, or in a
                           ///< gap of the former
  double room_size_m[3] = {0.0, 0.0, 0.0};
};

/**
 * Writes a recording of a simulated flight in EuRoC's layout: cam0, cam1, imu0,
 * state_groundtruth_estimate0. The same options give the same files, bit for bit.
 *
 * A recorded flight with a synthetic IMU is smoothed (SplineTrajectory) and the ground truth
 * written is the smoothed one, its biases those of the file where it has them. With a recorded IMU
 * the ground truth is copied as well and images are rendered at its rows (InterpolatedTrajectory).
 *
 * @throws ConfigError for options that cannot be, or an output folder that is not empty
 * @throws DataError for files that cannot be read or written, naming file and line
 */
SimulationSummary simulateRecording(const SimulationOptions& options);

}  // namespace etalon
