#include <algorithm>
#include <cmath>

#include "estimator.h"
#include "etalon/core/text.h"
#include "etalon/core/yaw.h"
#include "etalon/pipeline/odometry_start.h"
#include "odometry_kinds.h"

// The part of Estimator between a window of keyframes and the odometry that begins there.

namespace etalon {

void Estimator::tryInitialize() {
  imu_.dropBefore(window_.stamps().front() - durationNs(kFarthestTimeOffset));
  // A keyframe from before the first sample would have every window that it is in refused.
  if (!imu_.empty())
    window_.dropBefore(imu_.samples().front().t - durationNs(std::min(0.0, starter_.timeOffset())));
  if (window_.regularKeyframes() <
      (options_.windowsGrow() ? options_.min_keyframes : options_.keyframes))
    return;
  const Starter::Outcome outcome = starter_.attempt(&window_, [this](const WindowOptions& options) {
    return window_.problem(calibration_, options_.imu_noise, options, imu_);
  });
  if (outcome == Starter::Outcome::kRefused) return correctTimeOffset();
  const InitializationAttempt& attempt = starter_.attempts().back();
  if (outcome == Starter::Outcome::kTakesOver) {
    handed_over_at_ = attempt.t;
    replaceLast(startOdometry(attempt, keepingYawAndPosition(attempt)));
  } else if (state_ == PipelineState::kLost) {
    startAgain(attempt);
  } else {
    start(attempt);
  }
}

/** Where the refusal shows that the stamps of the images are off, the next attempt has them right,
 * and so has the odometry that it starts. */
void Estimator::correctTimeOffset() {
  const CalibrationMode mode = options_.fixed_lag.calibration.time_offset;
  if (starter_.attempts().empty() || options_.odometry_kind == kStereoVisual ||
      mode == CalibrationMode::kOff)
    return;
  const std::optional<RotationTimeOffset>& found = starter_.attempts().back().time_offset;
  if (!found || std::abs(found->offset_s) > kFarthestTimeOffset) return;
  starter_.setTimeOffset(found->offset_s);
  remark(starter_.attempts().back().t,
         {"by the rotations of images and gyro " + found->inWords() + "; corrected from here on"});
}

void Estimator::start(const InitializationAttempt& attempt) {
  // The last keyframe is the current frame: there the visual frame is tied to the world.
  const SE3 T_VB = estimates_.back().nav.T_WB;
  const OdometryOutput output = startOdometry(attempt, SE3());
  const SE3 T_WV = output.state.T_WB * T_VB.inverse();
  for (FrameEstimate& estimate : estimates_) estimate.nav.T_WB = T_WV * estimate.nav.T_WB;
  initialized_at_ = attempt.t;
  replaceLast(output);
}

void Estimator::startAgain(const InitializationAttempt& attempt) {
  const SE3 before = estimates_.back().nav.T_WB;
  replaceLast(startOdometry(attempt, keepingYawAndPosition(attempt)));
  PoseJump jump;
  jump.T_before_after = before.inverse() * estimates_.back().nav.T_WB;
  jump.covariance = lost_.covariance(estimates_.back().nav.T_WB.R);
  events_.back().jump = jump;
  if (relocalizer_) relocalizer_->startedAgain(estimates_.back().nav.T_WB, jump.covariance);
}

/** The odometry begins at the window's first keyframe and runs through the window's frames. */
OdometryOutput Estimator::startOdometry(const InitializationAttempt& attempt, const SE3& T_WA) {
  const bool recorded = inFlight();  // a handover: the flight record has the window's frames
  clock_.restart();
  odometry_ = makeOdometry(options_.odometry_kind, calibration_, options_, views_);
  const std::deque<TrackedFrame>& frames = window_.frames();
  showWindowImage(frames.front().t);
  OdometryStart start = odometryStart(attempt, T_WA, starter_.priors());
  const TimeNs first = frames.front().t, taken = first + durationNs(attempt.time_offset_used_s);
  if (taken != first)
    moveToStamp(attempt.time_offset_used_s,
                imu_.between(std::min(first, taken), std::max(first, taken)),
                options_.window.gravity_mps2, &start);
  OdometryOutput output = odometry_->start(start, frames.front());
  if (!recorded) record_.add(output.t, frames.front(), {}, output, odometry_.get());
  for (size_t i = 1; i < frames.size(); ++i) {
    const std::vector<ImuSample> imu = imu_.between(frames[i - 1].t, frames[i].t);
    showWindowImage(frames[i].t);
    output = odometry_->process(frames[i], imu);
    remark(frames[i].t, output.remarks);
    if (!recorded) record_.add(output.t, frames[i], imu, output, odometry_.get());
  }
  if (output.inertial) starter_.endWaitForMotion();
  if (!starter_.waitsForMotion()) window_.clear();
  window_images_.clear();
  const std::string by =
      attempt.initializer.empty() ? "a start was" : attempt.initializer + "'s start was";
  if (output.inertial) enter(PipelineState::kInertial, output.t, by + " accepted");
  return output;
}

/** The map takes its views from the window's frames, too, when the odometry runs through them. */
void Estimator::keepWindowImages(const StereoFrame& frame) {
  window_images_[frame.t] = frame;
  const std::deque<TrackedFrame>& frames = window_.frames();
  const auto first = frames.empty() ? window_images_.end() : window_images_.find(frames.front().t);
  window_images_.erase(window_images_.begin(), first);
}

void Estimator::showWindowImage(TimeNs t) {
  if (!views_) return;
  const StereoFrame& frame = window_images_.at(t);
  views_->show(frame.left, frame.right);
}

/** The last pose is the fixed-lag odometry's first. */
void Estimator::replaceLast(const OdometryOutput& output) {
  estimates_.pop_back();
  keep(output);
}

/** From the attempt's world A to the one that the odometry is in: the current pose keeps yaw and
 * position. */
SE3 Estimator::keepingYawAndPosition(const InitializationAttempt& attempt) const {
  return yawPositionAlignment(attempt.poses().back(), estimates_.back().nav.T_WB);
}

}  // namespace etalon
