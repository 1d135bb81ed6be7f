#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/keyframe_selector.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/odometry/input_border.h"
#include "etalon/odometry/repeated_images.h"
#include "etalon/odometry/window_initialization.h"

namespace etalon {

/** [pipeline] initializer = auto: at rest one plugin, in motion another. */
constexpr const char* kAutoInitializer = "auto";

/** Section [auto]. */
struct AutoOptions {
  std::string at_rest = "static";
  std::string moving = "eta";
  /** Of the window, before `moving` is tried: in seconds since the last window that was not known
   * to move, over the window's length. */
  double min_motion_share = 0.0;

  void declare(ParameterSet& parameters);
};

/** The initializers of a pipeline. */
struct PipelineInitializers {
  std::string name;  ///< of `initializer`
  std::shared_ptr<const Initializer> initializer;
  /** Tried first, for a start at rest; null: there is none. */
  std::shared_ptr<const Initializer> at_rest;
  std::string at_rest_name;
};

/** Everything that a run needs to know; one INI section a member (see PipelineOptions::sections).
 */
struct PipelineOptions {
  std::string initializer = "eta";  ///< name of the plugin, or kAutoInitializer
  int keyframes = 10;               ///< in the initialization window
  double keyframe_rate_hz = 4.0;    ///< until initialised
  WindowOptions window;
  InputOptions input;
  ImuNoiseOptions imu_noise;
  StereoTrackerOptions frontend;
  AutoOptions auto_initializer;
  FixedLagOptions fixed_lag;

  /** The parameters of every section, bound to this object: [pipeline], [imu_noise], [priors],
   * [frontend], ... */
  std::vector<ParameterSet> sections();
};

enum class PipelineState { kCollecting, kInitialized };

/** Milliseconds of the stages of one frame. */
struct FrameTiming {
  double frontend_ms = 0.0;
  double odometry_ms = 0.0;
  double initialization_ms = 0.0;
};

/**
 * The stages tied together: measurements in, trajectory and initialization attempts out. What is
 * wrong with a measurement is recognised at the InputBorder, dropped or repaired, and counted; bad
 * data never throw. Stamps stay those of the measurements, to the nanosecond.
 *
 * After a jump of the clock, or a gap that long, the trajectory goes on from the last pose, and a
 * window of keyframes starts anew. A frame that repeats an image of the one before while the
 * platform moves is not tracked: its pose is a prediction.
 *
 * With an initializer for the start at rest: once that has started the odometry, the window goes
 * on; when the at-rest initializer refuses it with kTooMuchMotion, and enough of it is in motion,
 * the other one is tried at every keyframe, and what is accepted takes over: its biases, landmarks,
 * roll and pitch, turned and moved so that yaw and position of the current pose stay as they are.
 * Poses before keep theirs. The gyro bias of the start is the handover's prior.
 */
class Pipeline {
 public:
  static constexpr size_t kDetailedAttempts = 40;  ///< ten seconds of keyframes

  Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
           PipelineInitializers initializers);
  ~Pipeline();

  void add(const ImuSample& sample);
  /** Processed as soon as the IMU has reached its stamp (see InputBorder). */
  void add(const StereoFrame& frame);
  /** Processes what still waits. */
  void finish();

  PipelineState state() const { return state_; }
  /** Poses of all frames so far: in W once initialised (those before too), in V until then. */
  const Trajectory& trajectory() const { return trajectory_; }
  /** Of a refusal that is older than the last kDetailedAttempts, time, status, reason and timings
   * are kept, estimates are not: a pipeline that never starts must not fill the memory. Refusals of
   * the at-rest initializer are here too, but those of a platform that began to move as it was
   * waited for. */
  const std::vector<InitializationAttempt>& attempts() const { return attempts_; }
  /** One a processed frame. */
  const std::vector<FrameTiming>& timings() const { return timings_; }
  int keyframesCollected() const { return static_cast<int>(window_keyframes_.size()); }
  int framesNotLocated() const { return frames_not_located_; }
  /** What was wrong with the measurements so far; empty if nothing. */
  const InputFaultCounts& inputFaults() const { return border_.faults(); }
  /** Biases in use: the prior's mean until initialised. */
  const ImuBias& bias() const { return bias_; }
  TimeNs initializedAt() const { return initialized_at_; }
  /** When the initializer for motion took over from the one at rest. */
  const std::optional<TimeNs>& handedOverAt() const { return handed_over_at_; }
  /** The running odometry: its window and landmarks, in the frame of the last pose. */
  const StereoOdometry& odometry() const { return odometry_; }
  /** Whether it was started at rest and the initializer for motion has not taken over yet. */
  bool waitsForMotion() const { return waits_for_motion_; }

 private:
  void processAdmitted();
  void process(const ImuSample& sample);
  void process(const StereoFrame& frame);
  void restartWindow();
  Eigen::Matrix3d rotationSince(TimeNs t0, TimeNs t1) const;
  void keep(InitializationAttempt attempt);
  bool collecting() const { return state_ == PipelineState::kCollecting || waits_for_motion_; }
  InitializationProblem windowProblem(const WindowOptions& options) const;
  void tryInitialize();
  bool startsAtRest(const InitializationProblem& problem);
  bool isInMotion(const InitializationProblem& problem);
  WindowOptions handoverOptions() const;
  void start(const InitializationAttempt& attempt);
  void takeOver(const InitializationAttempt& attempt);
  void adopt(const InitializationAttempt& attempt, const SE3& T_WA);
  void dropBeforeWindow();

  StereoInertialCalibration calibration_;
  PipelineOptions options_;
  PipelineInitializers initializers_;
  ImuNoiseDensities noise_;
  InputBorder border_;
  RepeatedImages repeated_images_;
  StereoTracker tracker_;
  KeyframeSelector selector_;
  StereoOdometry odometry_;
  ImuBuffer imu_;
  std::deque<TrackedFrame> window_frames_;  ///< since the first keyframe of the window
  std::deque<TimeNs> window_keyframes_;
  std::optional<TimeNs> tracked_at_;  ///< the last frame that the tracker saw
  std::optional<TimeNs> last_frame_;  ///< the last frame of all
  PipelineState state_ = PipelineState::kCollecting;
  bool waits_for_motion_ = false;
  TimeNs initialized_at_ = 0;
  std::optional<TimeNs> handed_over_at_;
  TimeNs last_rest_ = 0;  ///< last keyframe of the last window that was not known to move
  ImuBias bias_;
  double sigma_gyro_bias_ = 0.0;  ///< of bias_ when it was estimated, of the worst axis, rad/s
  Trajectory trajectory_;
  std::vector<InitializationAttempt> attempts_;
  std::vector<FrameTiming> timings_;
  int frames_not_located_ = 0;
};

}  // namespace etalon
