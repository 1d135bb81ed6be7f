#pragma once

#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/nav_state.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/imu/imu_buffer.h"

namespace etalon::testing {

/** The motion of a window. What the name leaves open is drawn from the seed. */
enum class Motion { kGentle, kAggressive, kCircle, kPureRotation, kConstantVelocity, kStandstill };

const char* toString(Motion motion);
constexpr Motion kAllMotions[] = {Motion::kGentle,           Motion::kAggressive,
                                  Motion::kCircle,           Motion::kPureRotation,
                                  Motion::kConstantVelocity, Motion::kStandstill};

struct SyntheticWindowOptions {
  Motion motion = Motion::kGentle;
  unsigned seed = 1;
  int keyframes = 10;
  double keyframe_rate_hz = 4.0;
  int frames_per_keyframe = 5;
  double imu_rate_hz = 200.0;
  int landmarks = 250;  ///< seen per frame, about
  /** Distance of all landmarks from the middle of the path, m; 0: they lie on walls 3 m away. */
  double landmark_distance_m = 0.0;
  ImuBias bias;  ///< added to the measurements
  /** Noise; zero means none. The IMU's are factors on the calibration's densities. */
  double sigma_px = 0.0;
  double gyro_noise_factor = 0.0;
  double accel_noise_factor = 0.0;
  double outlier_share = 0.0;  ///< of pixels, moved by 5 to 50 px
  double gravity_mps2 = 9.81;
  TimeNs start = 1'400'000'000'000'000'000;
  /** The world turned by this yaw about its z and moved: no measurement depends on it. */
  double world_yaw_rad = 0.0;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  /** What the problem believes: assumed pixel noise and densities (data sheet times factor). */
  double assumed_sigma_px = 1.0;
  double assumed_noise_factor = 1.0;
  BiasPriors priors;
};

/**
 * A window of stereo tracks and IMU samples with exact truth. The truth is the midpoint integral of
 * the noise-free IMU samples, so a noise-free window is consistent with Preintegration to rounding,
 * whatever the IMU's rate.
 */
struct SyntheticWindow {
  StereoInertialCalibration calibration;  ///< EuRoC's
  std::vector<TrackedFrame> frames;
  std::vector<int> keyframe_indices;
  ImuBuffer imu;
  std::vector<StampedState> truth;  ///< one a keyframe, in a gravity-aligned world; with `bias`
  ImuBias bias;
  std::vector<Eigen::Vector3d> landmarks;  ///< p_W, index = LandmarkId

  std::vector<const TrackedFrame*> keyframes() const;
};

SyntheticWindow makeSyntheticWindow(const SyntheticWindowOptions& options);

}  // namespace etalon::testing
