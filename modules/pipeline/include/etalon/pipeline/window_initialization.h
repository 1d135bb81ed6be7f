#pragma once

#include <memory>
#include <string>
#include <vector>

#include "etalon/initialization/acceptance.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/time_offset_of_rotations.h"
#include "etalon/odometry/stereo_odometry.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"

namespace etalon {

/** Everything between a window of tracked frames and a judged initialization. */
struct WindowOptions {
  StereoOdometryOptions odometry;
  /** The slow error is what windows of real flights show (README.md of the plugin `etalon`). */
  BiasPriors priors{ImuBias(), 0.1, 0.1, {0.016, 0.68}};
  VisualInertialBaOptions vi_ba;
  AcceptanceOptions acceptance;
  double gravity_mps2 = 9.81;
  /** Of growing windows: after so long an additional keyframe confirms an estimate that has none
   * before it to be compared with, s; 0: the next regular one does. */
  double confirm_after_s = 0.0;
  /** By which images are later, in the IMU's time, than their stamps: the problem's IMU is moved to
   * the stamps. Not a key. */
  double time_offset_s = 0.0;
  /** Without, an attempt ends with the initializer: what it calls a success is accepted. Not a
   * key. */
  bool refine = true;
  /** VisualInertialBaResult::noise is wanted also where the acceptance does not judge by it. Not a
   * key. */
  bool check_noise = false;
};

/** What one attempt did, stage by stage. */
struct InitializationAttempt {
  TimeNs t = 0;                   ///< stamp of the last keyframe
  std::string initializer;        ///< name of the plugin; empty where there is but one
  std::vector<TimeNs> keyframes;  ///< stamps of the window's keyframes
  /** The plugin's result. */
  InitializationResult init = refuse(Refusal());
  std::vector<StageTiming> init_timings;  ///< the plugin's own, also where its estimate was dropped
  bool has_vi_ba = false;
  VisualInertialBaResult vi_ba;                     ///< if has_vi_ba
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_W after VI-BA, or the plugin's
  /** What the pipeline does with it: starts, or refuses for the plugin's or its own reason. */
  Expected<void> decision = refuse(Refusal());
  double stereo_odometry_ms = 0.0, initialize_ms = 0.0, vi_ba_ms = 0.0;
  bool used_stereo_odometry = false;
  double visual_rms_px = 0.0;
  std::optional<FoundExtrinsics> extrinsics;  ///< of methods that estimate them
  /** Of a refusal that may come from the stamps of the images (kNotConverged, kImplausible), where it
   * is certain: by how much they are off, all in all. The refusal's reason says so, too. */
  std::optional<RotationTimeOffset> time_offset;
  double time_offset_used_s = 0.0;  ///< WindowOptions::time_offset_s

  bool accepted() const { return decision.has_value(); }
  /** The estimate that counts, in the attempt's world: VI-BA's, or the plugin's where there is
   * none. */
  std::vector<StampedState> states() const;
  std::vector<SE3> poses() const;  ///< of states()
  /** The first 11 rows and columns of Initialization::covariance, or VI-BA's; empty where there is
   * none. */
  Eigen::MatrixXd covariance() const;
  const ImuBias& bias() const { return has_vi_ba ? vi_ba.bias : init->bias; }
  /** Leaves time, keyframes, decision and timings. */
  void dropEstimates();
  /** Of the worst axis, rad/s; infinite without covariance. */
  double sigmaGyroBias() const;
};

/**
 * A problem from a window: stereo odometry is solved when the initializer asks for it.
 * @param frames all stereo frames of the window, the first and last being keyframes
 */
InitializationProblem makeProblem(const StereoInertialCalibration& calibration,
                                  const ImuNoiseDensities& noise, const WindowOptions& options,
                                  std::vector<TrackedFrame> frames,
                                  std::vector<int> keyframe_indices, ImuBuffer imu);

/** VI-BA from what an initializer found, with `options.vi_ba`, and priors and gravity of `options`. */
VisualInertialBaResult refine(const InitializationProblem& problem, const Initialization& start,
                              const WindowOptions& options,
                              std::map<LandmarkId, Eigen::Vector3d>* landmarks);

/** Initializer, VI-BA, acceptance. Deterministic but for the times. */
InitializationAttempt attemptInitialization(const InitializationProblem& problem,
                                            const Initializer& initializer,
                                            const WindowOptions& options);

}  // namespace etalon
