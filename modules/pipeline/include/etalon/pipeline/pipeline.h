#pragma once

#include <mrpt/obs/CObservation.h>

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/datasets/observation_input.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/frontend/front_stage.h"
#include "etalon/odometry/flight_record.h"
#include "etalon/odometry/imu_propagator.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/pipeline/input_border.h"
#include "etalon/pipeline/live_queue.h"
#include "etalon/pipeline/pipeline_options.h"
#include "etalon/pipeline/pipeline_state.h"
#include "etalon/pipeline/starter.h"

namespace etalon {

class Estimator;

/**
 * The stages tied together: measurements in, states and initialization attempts out. What is wrong
 * with a measurement is recognised at the InputBorder, dropped or repaired, and counted; bad data
 * never throw. Stamps stay those of the measurements, to the nanosecond.
 *
 * From the first image stereo odometry runs (kVisual), until an attempt at initialising is accepted
 * (Starter). Then an odometry of the chosen kind begins at the window's first keyframe and runs
 * through its frames. The fixed-lag odometry reads the IMU (kInertial); where images fail it, the
 * IMU carries it (kDeadReckoning). After max_dead_reckoning_s, or if the IMU fails, too, it is lost:
 * stereo odometry begins anew at the predicted pose, and the next attempt that is accepted starts
 * the fixed-lag odometry in the same world: position and yaw go on, and the event says how far off
 * they may be. When it sees a place from before the loss (Relocalizer), position and yaw jump back to
 * where they were by it.
 *
 * With kind = stereo_visual stereo odometry goes on in the world of the start (kVisual) and is never
 * lost. With an initializer for the start at rest, the one that takes over starts it again: with its
 * biases, landmarks, roll and pitch, turned and moved so that yaw and position of the window's last
 * keyframe stay. Poses before keep theirs.
 *
 * A frame that repeats an image of the one before while the platform moves is not tracked. Where
 * images, IMU samples or one of the cameras are missing and the state stays, an event says so.
 *
 * Threads. process(), add() and finish() may be called from any thread, and so may latest(),
 * stateAt() and inputFaults(). By default the work is done in the thread that delivers the
 * measurement, and the same measurements give the same run, bit for bit. With PipelineOptions::live
 * front end and estimator have a thread each and the call returns at once; a frame that still waits
 * for a stage when the next one comes is dropped and counted (InputFault::kFrameLate), unless both
 * come in one burst (LiveQueue). All
 * other accessors are for between calls and, live, for after finish(). What one of these threads
 * throws ends the run: every later process(), add() or finish() throws it.
 */
class Pipeline {
 public:
  Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
           PipelineInitializers initializers);
  ~Pipeline();

  /**
   * What a sensor driver or a rawlog delivers: CObservationIMU, CObservationStereoImages, or
   * CObservationImage by pairs, labelled "cam0" and "cam1" (ObservationInput). Others are ignored;
   * what is broken is counted. Relative paths of external images start at the working folder. The
   * caller may use the observation's images again.
   */
  void process(const mrpt::obs::CObservation& observation);
  void add(const ImuSample& sample);
  /** Processed as soon as the IMU has reached its stamp (see InputBorder). The pixels are copied, so
   * that the caller may use its buffers again, unless they come in images that nobody else holds: a
   * frame that is given away (std::move) costs no copy. */
  void add(StereoFrame frame);
  /** Processes what still waits; live, waits for it. What comes later is ignored. */
  void finish();

  /** Calls `listener` after every frame, in the thread that processed it. To be set before the first
   * measurement. The listener must not call the pipeline, but for latest() and stateAt(). */
  void onFrame(std::function<void(const FrameEstimate&)> listener);
  /** Calls `listener` after every frame with its images and tracks; the same rules. */
  void onTracks(std::function<void(const FrontFrame&)> listener);
  /** Calls `listener` after every IMU sample since the start, in the thread that delivered it; the
   * same rules. */
  void onImuState(std::function<void(const ImuRateState&)> listener);
  /** The last frame's estimate; nothing before the first. */
  std::optional<FrameEstimate> latest() const;
  /** The state at `t`: from the last frame's stamp to the last IMU sample's; nothing else, and
   * nothing while stereo odometry runs. */
  std::optional<ImuRateState> stateAt(TimeNs t) const;

  PipelineState state() const;
  /** When the state changed, and why; and what was missing where it did not (MissingInput). */
  const std::vector<PipelineEvent>& events() const;
  /** Stamp of the frame at which the first attempt was accepted. */
  const std::optional<TimeNs>& initializedAt() const;
  /** Poses of all frames so far: in W once initialised (those before too), in V until then. */
  Trajectory trajectory() const;
  /** One a frame; their poses are trajectory(). */
  const std::vector<FrameEstimate>& estimates() const;
  /** trajectory() with hindsight: of every keyframe the last estimate before it left the fixed-lag
   * odometry's window, what is between follows (FlightRecord::smoothedFlight()). */
  Trajectory smoothedTrajectory() const;
  /** What of the flight is remembered for it, and the landmarks. */
  const FlightRecord& record() const;
  /** A bundle adjustment of all keyframes, images and IMU; with PipelineOptions::final_ba. The
   * trajectory is carriedAlong(smoothedTrajectory(), FinalFlight::keyframes).
   * @param go_on TrajectoryBaOptions::go_on */
  FinalFlight finalBa(const std::function<bool(int iterations)>& go_on = {}) const;
  /** What the flight says of the calibration since the last start; empty while stereo odometry runs
   * and where nothing of it is looked at. */
  std::vector<CalibrationFinding> calibrationFindings() const;
  /** The calibration that the odometry uses: what was given, corrected. */
  StereoInertialCalibration calibrationInUse() const;
  /** What the initializers said (Starter::attempts). */
  const std::vector<InitializationAttempt>& attempts() const;
  size_t attemptCount() const;
  /** One a processed frame. */
  const std::vector<FrameTiming>& timings() const;
  int keyframesCollected() const;
  int framesNotLocated() const;
  /** What was wrong with the measurements so far; empty if nothing. */
  InputFaultCounts inputFaults() const;
  /** Biases in use: the prior's mean until initialised. */
  const ImuBias& bias() const;
  /** Stamp at which the initializer for motion took over from the one at rest. */
  const std::optional<TimeNs>& handedOverAt() const;
  /** Whether it was started at rest and the initializer for motion has not taken over yet. */
  bool waitsForMotion() const;

 private:
  using EstimatorInput = std::variant<ImuSample, FrontFrame, ClockJump>;

  void admit(StereoFrame frame);
  void processAdmitted();
  void runFrontEnd(AdmittedInput input);
  void deliver(EstimatorInput input);
  void estimate(const EstimatorInput& input);
  void startThreads();
  void runStage(const std::function<void()>& stage);
  void joinThreads();
  void throwFailure() const;
  void count(InputFault fault, TimeNs t);
  void propagate(const ImuSample& sample);
  void publish(const FrameEstimate& estimate);
  std::optional<ImuRateState> propagatedState(TimeNs t) const;

  mutable std::mutex border_mutex_;  ///< of what delivers measurements, to runFrontEnd()
  bool finished_ = false;
  ObservationInput observation_input_;
  InputBorder border_;
  FrontStage front_;
  ImuBuffer front_imu_;
  std::unique_ptr<Estimator> estimator_;
  std::unique_ptr<LiveQueue<AdmittedInput, StereoFrame>> front_queue_;  ///< live
  std::unique_ptr<LiveQueue<EstimatorInput, FrontFrame>> estimator_queue_;
  std::thread front_thread_, estimator_thread_;

  mutable std::mutex shared_mutex_;  ///< of what both threads and any reader see
  std::exception_ptr failure_;       ///< what ended a thread
  InputFaultCounts run_faults_;
  ImuPropagator propagator_;
  ImuBias front_bias_;            ///< what the front end believes of the gyro
  bool front_in_flight_ = false;  ///< no window for a start is being collected
  std::optional<FrameEstimate> latest_;
  double latest_lag_s_ = 0.0;  ///< by which the IMU was ahead of it when it was known
  double no_image_s_;
  std::function<void(const FrameEstimate&)> on_frame_;
  std::function<void(const FrontFrame&)> on_tracks_;
  std::function<void(const ImuRateState&)> on_imu_state_;
};

}  // namespace etalon
