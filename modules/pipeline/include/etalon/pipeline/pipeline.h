#pragma once

#include <optional>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/pipeline/input_border.h"
#include "etalon/pipeline/repeated_images.h"
#include "etalon/pipeline/starter.h"

namespace etalon {

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
 * With an initializer for the start at rest (Starter), the one that takes over brings its biases,
 * landmarks, roll and pitch, turned and moved so that yaw and position of the current pose stay.
 * Poses before keep theirs.
 */
class Pipeline {
 public:
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
  /** What the initializers said (Starter::attempts). */
  const std::vector<InitializationAttempt>& attempts() const { return starter_.attempts(); }
  /** One a processed frame. */
  const std::vector<FrameTiming>& timings() const { return timings_; }
  int keyframesCollected() const { return static_cast<int>(window_.stamps().size()); }
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
  bool waitsForMotion() const { return starter_.waitsForMotion(); }

 private:
  void processAdmitted();
  void process(const ImuSample& sample);
  void process(const StereoFrame& frame);
  Eigen::Matrix3d rotationSince(TimeNs t0, TimeNs t1) const;
  bool collecting() const {
    return state_ == PipelineState::kCollecting || starter_.waitsForMotion();
  }
  void tryInitialize();
  void start(const InitializationAttempt& attempt);
  void takeOver(const InitializationAttempt& attempt);
  void adopt(const InitializationAttempt& attempt, const SE3& T_WA);

  StereoInertialCalibration calibration_;
  PipelineOptions options_;
  ImuNoiseDensities noise_;
  InputBorder border_;
  RepeatedImages repeated_images_;
  StereoTracker tracker_;
  StereoOdometry odometry_;
  ImuBuffer imu_;
  KeyframeWindow window_;
  Starter starter_;
  std::optional<TimeNs> tracked_at_;  ///< the last frame that the tracker saw
  std::optional<TimeNs> last_frame_;  ///< the last frame of all
  PipelineState state_ = PipelineState::kCollecting;
  TimeNs initialized_at_ = 0;
  std::optional<TimeNs> handed_over_at_;
  ImuBias bias_;
  Trajectory trajectory_;
  std::vector<FrameTiming> timings_;
  int frames_not_located_ = 0;
};

}  // namespace etalon
