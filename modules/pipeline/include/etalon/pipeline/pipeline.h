#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/map/image_views.h"
#include "etalon/odometry/flight_record.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/pipeline/input_border.h"
#include "etalon/pipeline/pipeline_options.h"
#include "etalon/pipeline/pipeline_state.h"
#include "etalon/pipeline/repeated_images.h"
#include "etalon/pipeline/starter.h"

namespace etalon {

/** Milliseconds of the stages of one frame. */
struct FrameTiming {
  double frontend_ms = 0.0;
  double odometry_ms = 0.0;
  double initialization_ms = 0.0;
};

/**
 * The stages tied together: measurements in, states and initialization attempts out. What is wrong
 * with a measurement is recognised at the InputBorder, dropped or repaired, and counted; bad data
 * never throw. Stamps stay those of the measurements, to the nanosecond.
 *
 * From the first image stereo odometry runs (kVisual), until an attempt at initialising is accepted
 * (Starter). With [odometry] kind = fixed_lag the fixed-lag odometry begins there, with the
 * attempt's covariance (kInertial); where images fail it, the IMU carries it (kDeadReckoning).
 * After max_dead_reckoning_s, or if the IMU fails, too, it is lost: stereo odometry begins anew at
 * the predicted pose, and the next attempt that is accepted starts the fixed-lag odometry in the
 * same world: position and yaw go on, and the event says how far off they may be.
 *
 * With kind = stereo_visual stereo odometry goes on in the world of the start. With an initializer
 * for the start at rest, the one that takes over brings its biases, landmarks, roll and pitch,
 * turned and moved so that yaw and position of the current pose stay. Poses before keep theirs.
 *
 * A frame that repeats an image of the one before while the platform moves is not tracked.
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
  /** When the state changed, and why. */
  const std::vector<PipelineEvent>& events() const { return events_; }
  /** Stamp of the frame at which the first attempt was accepted. */
  const std::optional<TimeNs>& initializedAt() const { return initialized_at_; }
  /** Poses of all frames so far: in W once initialised (those before too), in V until then. */
  const Trajectory& trajectory() const { return trajectory_; }
  /** One a pose of trajectory(). */
  const std::vector<FrameEstimate>& estimates() const { return estimates_; }
  /** trajectory() with hindsight: of every keyframe the last estimate before it left the fixed-lag
   * odometry's window, what is between follows (carriedAlong()). */
  Trajectory smoothedTrajectory() const;
  /** A bundle adjustment of all keyframes, images and IMU; with PipelineOptions::final_ba. The
   * trajectory is carriedAlong(smoothedTrajectory(), FinalFlight::keyframes). */
  FinalFlight finalBa() const;
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
  /** Stamp at which the initializer for motion took over from the one at rest. */
  const std::optional<TimeNs>& handedOverAt() const { return handed_over_at_; }
  /** The stereo odometry: its window and landmarks, in the frame of the last pose. */
  const StereoOdometry& odometry() const { return odometry_; }
  /** Whether it was started at rest and the initializer for motion has not taken over yet. */
  bool waitsForMotion() const { return starter_.waitsForMotion(); }

 private:
  void processAdmitted();
  void process(const ImuSample& sample);
  void process(const StereoFrame& frame);
  std::optional<TrackedFrame> track(const StereoFrame& frame, TimeNs before,
                                    const Eigen::Matrix3d& R_prev_cur);
  void follow(TimeNs t, const std::optional<TrackedFrame>& tracked,
              const Eigen::Matrix3d& R_prev_cur, bool keyframe);
  void followInertially(TimeNs t, TimeNs before, const std::optional<TrackedFrame>& tracked);
  void keep(const OdometryOutput& output);
  void enter(PipelineState state, TimeNs t, const std::string& reason);
  void lose(const OdometryOutput& output, const std::string& reason);
  Eigen::Matrix3d rotationSince(TimeNs t0, TimeNs t1) const;
  bool collecting() const {
    return !initialized_at_ || starter_.waitsForMotion() || state_ == PipelineState::kLost;
  }
  void tryInitialize();
  void start(const InitializationAttempt& attempt);
  void startAgain(const InitializationAttempt& attempt);
  OdometryOutput startInertially(std::unique_ptr<Odometry> odometry,
                                 const InitializationAttempt& attempt, const SE3& T_WA);
  void keepWindowImages(const StereoFrame& frame);
  void showWindowImage(TimeNs t);
  void replaceLast(const OdometryOutput& output);
  SE3 keepingYawAndPosition(const InitializationAttempt& attempt) const;
  void adopt(const InitializationAttempt& attempt, const SE3& T_WA);

  StereoInertialCalibration calibration_;
  PipelineOptions options_;
  ImuNoiseDensities noise_;
  InputBorder border_;
  RepeatedImages repeated_images_;
  StereoTracker tracker_;
  StereoOdometry odometry_;
  std::unique_ptr<Odometry> inertial_;           ///< while kInertial or kDeadReckoning
  std::shared_ptr<ImageViews> views_;            ///< of inertial_; null without a map
  std::map<TimeNs, StereoFrame> window_images_;  ///< of the window's frames, for views_
  bool clock_jumped_ = false;                    ///< since the last frame
  FlightRecord record_;
  TimeNs clock_shift_ = 0;  ///< stamps less those that inertial_ is given
  TimeNs frame_step_ = 0;   ///< between the last two frames
  ImuBuffer imu_;
  KeyframeWindow window_;
  Starter starter_;
  std::optional<TimeNs> tracked_at_;  ///< the last frame that the tracker saw
  std::optional<TimeNs> last_frame_;  ///< the last frame of all
  PipelineState state_ = PipelineState::kWaiting;
  std::vector<PipelineEvent> events_;
  std::optional<TimeNs> initialized_at_, handed_over_at_;
  ImuBias bias_;
  /** Of the last pose of the fixed-lag odometry, when it was lost. */
  Eigen::Matrix<double, 6, 6> lost_covariance_ = Eigen::Matrix<double, 6, 6>::Zero();
  Trajectory trajectory_;
  std::vector<FrameEstimate> estimates_;
  std::vector<FrameTiming> timings_;
  int frames_not_located_ = 0;
};

}  // namespace etalon
