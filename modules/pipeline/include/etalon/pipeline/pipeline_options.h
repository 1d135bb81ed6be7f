#pragma once

#include <string>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/map/map_options.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/pipeline/device_file.h"
#include "etalon/pipeline/input_border.h"
#include "etalon/pipeline/starter.h"

namespace etalon {

/** [odometry] kind: what runs after the start. Names of a table that is open (odometry_kinds.cpp): a
 * new odometry is one entry there, so the key is no enum. */
constexpr const char* kFixedLag = "fixed_lag";
constexpr const char* kStereoVisual = "stereo_visual";

/** Everything that a run needs to know; one INI section a member (see sections()). */
struct PipelineOptions {
  std::string initializer = "etalon";  ///< name of the plugin, or kAutoInitializer
  int min_keyframes = 3;               ///< in the first window that is tried
  int keyframes = 10;                  ///< in the initialization window, at most
  double keyframe_rate_hz = 4.0;       ///< of the initialization window
  std::string odometry_kind = kFixedLag;
  double max_dead_reckoning_s = 20.0;
  /** Front end and estimator on a thread each: what is late is dropped. Not a key. */
  bool live = false;
  /** Frames whose poses, estimates, events and timings are kept, at least, and as many attempts at
   * starting; 0: all. Not a key. */
  size_t history_frames = 0;
  bool final_ba = false;          ///< keep what Pipeline::finalBa() needs; not a key
  int final_ba_keyframes = 4000;  ///< of a longer flight, the newest
  WindowOptions window;
  FixedLagOptions fixed_lag;
  MapOptions map;
  InputOptions input;
  ImuNoiseOptions imu_noise;
  StereoTrackerOptions frontend;
  AutoOptions auto_initializer;
  DeviceOptions device;

  /** Whether windows grow: from one keyframe to the next until a start is accepted. Not with an
   * initializer for the start at rest, which is asked about whole windows. */
  bool windowsGrow() const { return min_keyframes < keyframes && initializer != kAutoInitializer; }

  /** fixed_lag, with gravity, pixel noise and IMU noise as all other steps have them.
   * @param data_sheet of the recording's IMU */
  FixedLagOptions fixedLag(const ImuNoiseDensities& data_sheet) const;

  /** The parameters of every section, bound to this object: [pipeline], [imu_noise], [priors],
   * [frontend], ... */
  std::vector<ParameterSet> sections();
};

}  // namespace etalon
