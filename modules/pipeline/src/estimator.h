#pragma once

// Private to the module.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "etalon/frontend/front_stage.h"
#include "etalon/map/image_views.h"
#include "etalon/odometry/flight_record.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/pipeline/input_border.h"
#include "etalon/pipeline/lost_pose.h"
#include "etalon/pipeline/missing_input.h"
#include "etalon/pipeline/pipeline_options.h"
#include "etalon/pipeline/relocalizer.h"
#include "etalon/pipeline/starter.h"
#include "odometry_clock.h"

namespace etalon {

/**
 * The estimating stage of a Pipeline, which says what its states mean: attempts at starting, the
 * odometry, its loss, places that are recognised, and the record of all of it. What comes in has
 * passed the border and the front end, in order. For one thread.
 */
class Estimator {
 public:
  Estimator(const StereoInertialCalibration& calibration, const PipelineOptions& options,
            PipelineInitializers initializers);

  void add(const ClockJump& jump);
  /** @return whether the platform is lost with it: dead reckoning has lasted too long, and no frame
   * came that would have ended it */
  bool add(const ImuSample& sample);
  /** @return false if it is dropped: it is no later than the last one, or than the end of dead
   * reckoning. Else its estimate is the last of estimates(). */
  bool add(const FrontFrame& frame);
  /** There is nothing more to come. */
  void finish();

  // What Pipeline passes on; it says what each of them is.
  PipelineState state() const { return state_; }
  const std::vector<PipelineEvent>& events() const { return events_; }
  const std::optional<TimeNs>& initializedAt() const { return initialized_at_; }
  const std::optional<TimeNs>& handedOverAt() const { return handed_over_at_; }
  const std::vector<FrameEstimate>& estimates() const { return estimates_; }
  const std::vector<FrameTiming>& timings() const { return timings_; }
  const FlightRecord& record() const { return record_; }
  const Starter& starter() const { return starter_; }
  int keyframesCollected() const { return static_cast<int>(window_.stamps().size()); }
  int framesNotLocated() const { return frames_not_located_; }
  const ImuBias& bias() const { return bias_; }
  FinalFlight finalBa(const std::function<bool(int iterations)>& go_on) const;
  std::vector<CalibrationFinding> calibrationFindings() const;
  StereoInertialCalibration calibrationInUse() const;

  /** Whether a window for a start is being collected. */
  bool isCollecting() const { return !inFlight() || starter_.waitsForMotion(); }

 private:
  bool inFlight() const { return initialized_at_ && state_ != PipelineState::kLost; }
  TimeNs withoutFrameSince() const;
  void noticeMissingImages(TimeNs until);
  bool endDeadReckoning(TimeNs now);
  void dropSamplesBehind(const FrontFrame& frame);
  void forgetOld();
  void follow(TimeNs t, TimeNs before, const std::optional<TrackedFrame>& tracked);
  OdometryOutput followVisually(const NavState& state, const TrackedFrame& frame);
  void judge(const OdometryOutput& output, const std::optional<TrackedFrame>& tracked);
  void keep(const OdometryOutput& output);
  void enter(PipelineState state, TimeNs t, const std::string& reason);
  void remark(TimeNs t, const std::vector<std::string>& reasons);
  void lose(const OdometryOutput& output, const std::string& reason);
  void relocalize(const TrackedFrame& frame, OdometryOutput* output);
  void noteRecognition(TimeNs t, double seconds_ago, const PoseJump& jump);

  // The start (estimator_start.cpp).
  void tryInitialize();
  void correctTimeOffset();
  void start(const InitializationAttempt& attempt);
  void startAgain(const InitializationAttempt& attempt);
  OdometryOutput startOdometry(const InitializationAttempt& attempt, const SE3& T_WA);
  void keepWindowImages(const StereoFrame& frame);
  void showWindowImage(TimeNs t);
  void replaceLast(const OdometryOutput& output);
  SE3 keepingYawAndPosition(const InitializationAttempt& attempt) const;

  StereoInertialCalibration calibration_;
  PipelineOptions options_;
  ImuNoiseDensities noise_;

  // The stages. `odometry_` is of the chosen kind from a start that is accepted to a loss, else stereo
  // odometry; null before the first frame.
  KeyframeWindow window_;
  Starter starter_;
  std::unique_ptr<Odometry> odometry_;
  std::shared_ptr<ImageViews> views_;            ///< of the map; null without one
  std::map<TimeNs, StereoFrame> window_images_;  ///< of the window's frames, for views_
  std::optional<Relocalizer> relocalizer_;       ///< with a map
  LostPose lost_;                                ///< while kLost

  // Of the odometry before the last loss.
  std::vector<CalibrationFinding> last_findings_;
  std::optional<StereoInertialCalibration> last_calibration_;

  // What came last.
  ImuBuffer imu_;
  OdometryClock clock_;
  MissingInput missing_;
  double no_image_s_;
  std::optional<TimeNs> last_frame_, last_tracked_;
  double frame_lag_s_ = 0.0;    ///< by which the IMU was ahead of the last frame when that came
  double unlocated_s_ = 0.0;    ///< OdometryOutput::unlocated_s of the last frame
  bool no_image_said_ = false;  ///< since the last frame

  // What is known.
  PipelineState state_ = PipelineState::kWaiting;
  std::vector<PipelineEvent> events_;
  std::optional<TimeNs> initialized_at_, handed_over_at_;
  ImuBias bias_;
  std::vector<FrameEstimate> estimates_;
  std::vector<FrameTiming> timings_;
  FlightRecord record_;
  int frames_not_located_ = 0;
};

}  // namespace etalon
