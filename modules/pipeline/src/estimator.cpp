#include "estimator.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/stopwatch.h"
#include "etalon/core/text.h"
#include "kept_samples.h"
#include "odometry_kinds.h"

namespace etalon {

namespace {

/** Standard deviations of the biases across a loss, in those that the odometry had. */
constexpr double kBiasCaution = 2.0;

std::string whyNotLocated(const std::optional<TrackedFrame>& tracked,
                          const OdometryOutput& output) {
  if (!tracked) return "the cameras repeat their images";
  if (output.observations == 0) return "the images show no landmark";
  return "of " + std::to_string(output.observations) + " landmarks only " +
         std::to_string(output.used) + " are where the motion has them";
}

}  // namespace

Estimator::Estimator(const StereoInertialCalibration& calibration, const PipelineOptions& options,
                     PipelineInitializers initializers)
    : calibration_(calibration),
      options_(options),
      noise_(options.imu_noise.apply(calibration.imu.noise)),
      window_(options.keyframes, options.keyframe_rate_hz),
      starter_(std::move(initializers), options.auto_initializer, options.window, noise_,
               options.windowsGrow()),
      missing_(calibration),
      no_image_s_(noImageS(calibration.cameras[0].rate_hz)),
      bias_(options.window.priors.mean),
      record_(calibration,
              {noise_, options.window.gravity_mps2, options.window.odometry.sigma_px,
               options.final_ba ? static_cast<size_t>(options.final_ba_keyframes) : 0}) {
  options_.fixed_lag = options.fixedLag(calibration.imu.noise);
  if (options.map.enabled && options.odometry_kind != kStereoVisual)
    views_ = std::make_shared<ImageViews>(calibration);
  if (views_ && options.map.relocalize)
    relocalizer_.emplace(calibration, options.map, options.window.odometry.sigma_px, views_);
}

void Estimator::add(const ClockJump& jump) {
  remark(std::max(jump.from, jump.to), {missing_.clockJumped(jump.from, jump.to)});
  imu_ = ImuBuffer();
  window_.restart();
  clock_.jump(jump.from, jump.to);
}

bool Estimator::add(const ImuSample& sample) {
  keepSample(sample, last_frame_, &imu_);
  missing_.sample(sample.t, sample.saturated != 0);
  if (options_.live) noticeMissingImages(sample.t - durationNs(frame_lag_s_));
  return endDeadReckoning(sample.t);
}

bool Estimator::add(const FrontFrame& frame) {
  // Held at the border for long, it comes after the end of dead reckoning.
  if (last_frame_ && frame.t <= *last_frame_) return false;
  FrameTiming timing;
  timing.frontend_ms = frame.ms;
  Stopwatch watch;
  noticeMissingImages(frame.t);
  no_image_said_ = false;
  const TimeNs before = last_frame_.value_or(frame.t);
  const bool imu = before == frame.t || imu_.covers(before, frame.t);
  const int not_located = frames_not_located_;
  const PipelineState state_before = state_;
  last_frame_ = frame.t;
  frame_lag_s_ =
      imu_.empty() ? 0.0 : std::max(0.0, secondsBetween(frame.t, imu_.samples().back().t));
  // Not as the front end sees it: live, frames between may have been dropped.
  if (last_tracked_ && secondsBetween(*last_tracked_, frame.t) > options_.input.max_gap_s)
    window_.restart();
  if (frame.tracked) last_tracked_ = frame.t;
  if (views_ && frame.tracked) views_->show(frame.images.left, frame.images.right);
  follow(frame.t, before, frame.tracked);  // a loss begins a new window
  const bool keyframe = frame.tracked && window_.isKeyframe(frame.t);
  const bool located = not_located == frames_not_located_;
  if (state_before == PipelineState::kLost && !located)
    lost_.goBlind(std::max(secondsBetween(before, frame.t), clock_.jumpedSeconds()), imu);
  if (state_ == PipelineState::kLost)
    estimates_.back().pose_covariance = lost_.covariance(estimates_.back().nav.T_WB.R);
  clock_.frameDone(frame.t, imu_.empty() ? frame.t : imu_.samples().back().t);
  remark(frame.t, missing_.frame({frame.t, frame.tracked ? &*frame.tracked : nullptr, imu, located,
                                  state_before, state_}));
  timing.odometry_ms = watch.lapMilliseconds();

  if (frame.tracked && isCollecting()) {
    window_.add(*frame.tracked, keyframe);
    if (views_) keepWindowImages(frame.images);
    if (keyframe) tryInitialize();
    timing.initialization_ms = watch.lapMilliseconds();
  } else {
    dropSamplesBehind(frame);
  }
  timings_.push_back(timing);
  forgetOld();
  return true;
}

void Estimator::finish() {
  if (!last_frame_) return;
  // Where the IMU goes on a little longer the last image is just the end of the recording.
  if (!imu_.empty() &&
      secondsBetween(*last_frame_, imu_.samples().back().t) > options_.input.max_gap_s)
    noticeMissingImages(imu_.samples().back().t);
  remark(*last_frame_, missing_.finish());
}

/** Since when there is no frame: the last one, or a jump of the clock since then. */
TimeNs Estimator::withoutFrameSince() const {
  return clock_.hasJumped() ? clock_.jumpedTo() : *last_frame_;
}

/** From the last frame to `until`: there, the IMU alone carried the pose. */
void Estimator::noticeMissingImages(TimeNs until) {
  if (!last_frame_) return;
  const TimeNs from = withoutFrameSince();
  const double missing_s = secondsBetween(from, until);
  if (missing_s <= no_image_s_) return;
  const std::string text = format("no image came for %.1f s", missing_s);
  const TimeNs since = from + durationNs(no_image_s_);
  if (state_ == PipelineState::kInertial) enter(PipelineState::kDeadReckoning, since, text);
  // In a state that rests on images alone it is said while they are missing, once.
  if (options_.live && state_ != PipelineState::kDeadReckoning && !no_image_said_)
    remark(since, {text});
  no_image_said_ = true;
}

/** Of the IMU, what neither the next frame nor the window of keyframes needs. */
void Estimator::dropSamplesBehind(const FrontFrame& frame) {
  if (!isCollecting()) return imu_.dropBefore(frame.t);
  const TimeNs first = window_.stamps().empty() ? frame.t : window_.stamps().front();
  imu_.dropBefore(first - durationNs(kFarthestTimeOffset));
}

void Estimator::forgetOld() {
  const size_t keep = options_.history_frames;
  if (keep > 0) starter_.forgetOld(keep);
  if (keep == 0 || estimates_.size() < 2 * keep) return;
  const std::ptrdiff_t old = estimates_.size() - keep;
  estimates_.erase(estimates_.begin(), estimates_.begin() + old);
  timings_.erase(timings_.begin(), timings_.begin() + old);
  const TimeNs first = estimates_.front().t;
  record_.forgetBefore(first);
  const auto is_kept = [first](const PipelineEvent& event) { return event.t >= first; };
  events_.erase(events_.begin(), std::find_if(events_.begin(), events_.end(), is_kept));
}

void Estimator::follow(TimeNs t, TimeNs before, const std::optional<TrackedFrame>& tracked) {
  clock_.frame(before, t);
  // Not what the front end cut out for the frame: live, frames between may have been dropped.
  const std::vector<ImuSample> imu = clock_.at(imu_.between(before, t));
  TrackedFrame frame = tracked.value_or(TrackedFrame());
  frame.t = clock_.at(t);
  if (state_ == PipelineState::kWaiting) enter(PipelineState::kVisual, t, "the first images came");
  OdometryOutput output = odometry_ ? odometry_->process(frame, imu) : followVisually({}, frame);
  if (inFlight()) record_.add(t, frame, imu, output, odometry_.get());
  remark(t, output.remarks);
  output.t = t;
  if (output.unlocated_s > 0.0) ++frames_not_located_;
  unlocated_s_ = output.unlocated_s;
  if (output.inertial) judge(output, tracked);
  if (relocalizer_ && (state_ == PipelineState::kLost || relocalizer_->isLooking()))
    relocalizer_->prepare();
  if (output.recognition) {
    const SE3 T_WB_before = output.recognition->T_WW0.inverse() * output.state.T_WB;
    noteRecognition(
        t, secondsBetween(output.recognition->keyframe, frame.t),
        {T_WB_before.inverse() * output.state.T_WB, output.covariance.topLeftCorner<6, 6>()});
  } else if (output.keyframe && state_ == PipelineState::kInertial) {
    relocalize(frame, &output);
  }
  keep(output);
  frame.t = t;
  if (output.inertial && state_ == PipelineState::kLost) followVisually(output.state, frame);
}

/** Stereo odometry runs from here to the next start that is accepted. */
OdometryOutput Estimator::followVisually(const NavState& state, const TrackedFrame& frame) {
  OdometryStart start;
  start.state = state;
  start.state.bias = bias_;
  clock_.restart();
  odometry_ = makeOdometry(kStereoVisual, calibration_, options_);
  return odometry_->start(start, frame);
}

/** Where dead reckoning has lasted too long and no image comes that would end it, the odometry is
 * lost all the same; no frame has that pose. */
bool Estimator::endDeadReckoning(TimeNs now) {
  constexpr double kFrameMayFollowS = 0.1;  // the samples up to its stamp, at least
  constexpr double kLongerS = 1e-3;
  const bool by_imu = state_ == PipelineState::kInertial || state_ == PipelineState::kDeadReckoning;
  const double left_s = options_.max_dead_reckoning_s - unlocated_s_ + kLongerS;
  if (!by_imu || left_s <= 0.0) return false;
  const TimeNs from = withoutFrameSince();
  if (secondsBetween(from, now) < left_s + std::max(kFrameMayFollowS, frame_lag_s_)) return false;
  const TimeNs t = from + durationNs(left_s);
  noticeMissingImages(t);
  std::vector<ImuSample> imu;
  if (clock_.hasJumped())  // the IMU does not tell the motion across it
    clock_.frame(*last_frame_, t);
  else
    imu = imu_.between(*last_frame_, t);
  TrackedFrame nothing;
  nothing.t = clock_.at(t);
  OdometryOutput output = odometry_->process(nothing, clock_.at(imu));
  output.t = t;
  judge(output, nothing);
  if (state_ == PipelineState::kLost) {
    if (clock_.hasJumped()) lost_.goBlind(left_s, false);
    nothing.t = t;
    followVisually(output.state, nothing);
    last_frame_ = t;
  }
  clock_.frameDone(t, now);
  return state_ == PipelineState::kLost;
}

/** What state the pipeline is in after a frame of an odometry that reads the IMU. */
void Estimator::judge(const OdometryOutput& output, const std::optional<TrackedFrame>& tracked) {
  // Images that repeat the ones before are missing like those that do not come.
  const bool brief = !tracked && output.unlocated_s <= no_image_s_;
  if (output.unlocated_s == 0.0 || (brief && state_ == PipelineState::kInertial)) {
    enter(PipelineState::kInertial, output.t, "images locate the platform again");
  } else if (const std::string why =
                 whyLost(output, options_.max_dead_reckoning_s, clock_.hasJumped());
             !why.empty()) {
    lose(output, why);
  } else {
    enter(PipelineState::kDeadReckoning, output.t, whyNotLocated(tracked, output));
  }
}

void Estimator::keep(const OdometryOutput& output) {
  FrameEstimate estimate;
  estimate.t = output.t;
  estimate.state = state_;
  estimate.nav.T_WB = output.state.T_WB;
  bias_ = output.state.bias;
  if (output.inertial) {
    estimate.nav = output.state;
    estimate.pose_covariance = output.covariance.topLeftCorner<6, 6>();
    estimate.motion_variance = output.covariance.diagonal().tail<9>();
  }
  estimates_.push_back(estimate);
}

void Estimator::enter(PipelineState state, TimeNs t, const std::string& reason) {
  if (state == state_) return;
  state_ = state;
  events_.push_back({t, state, reason, false, std::nullopt});
}

void Estimator::remark(TimeNs t, const std::vector<std::string>& reasons) {
  for (const std::string& reason : reasons)
    events_.push_back({t, state_, reason, true, std::nullopt});
}

void Estimator::lose(const OdometryOutput& output, const std::string& reason) {
  enter(PipelineState::kLost, output.t, reason);
  record_.interrupt();
  if (relocalizer_) relocalizer_->lost(odometry_->seenFrom());
  last_findings_ = odometry_->calibrationFindings();
  last_calibration_ = odometry_->calibrationInUse();
  lost_ = LostPose(output.state, output.covariance);
  const Eigen::Array<double, 15, 1> sigma = output.covariance.diagonal().array().sqrt();
  starter_.knowBiases(output.t, output.state.bias,
                      kBiasCaution * sigma.segment<3>(state_index::kGyroBias).maxCoeff(),
                      kBiasCaution * sigma.segment<3>(state_index::kAccelBias).maxCoeff());
  // Across a jump of the clock the odometry went on by the step of the frames before.
  if (clock_.hasJumped()) lost_.goBlind(clock_.jumpedSeconds(), false);
  window_.restart();
}

/** Where a keyframe shows a place from before the last loss. @param frame in the odometry's time */
void Estimator::relocalize(const TrackedFrame& frame, OdometryOutput* output) {
  if (!relocalizer_ || !relocalizer_->isLooking()) return;
  const SE3 before = output->state.T_WB;
  const Trajectory seen_from = odometry_->seenFrom();
  const SE3 at_image = seen_from.empty() ? before : seen_from.back().T_WB;
  const auto found = relocalizer_->look(frame, at_image, odometry_->landmarks());
  if (!found) return;
  record_.recall(found->recalled);
  if (!found->moves || !odometry_->moveWorld(found->T_WW0)) return;
  record_.moveWorld(found->T_WW0);
  output->state = output->state.moved(found->T_WW0);
  const auto turn = errorsTurned(found->T_WW0.R);
  output->covariance = (turn * output->covariance * turn.transpose()).eval();
  noteRecognition(output->t, secondsBetween(found->place, frame.t),
                  {before.inverse() * output->state.T_WB, found->covariance});
}

void Estimator::noteRecognition(TimeNs t, double seconds_ago, const PoseJump& jump) {
  events_.push_back(
      {t, state_,
       format("a place from %.1f s ago is recognized, and the pose is corrected by it",
              seconds_ago),
       true, jump});
}

FinalFlight Estimator::finalBa(const std::function<bool(int iterations)>& go_on) const {
  TrajectoryBaOptions options;
  options.go_on = go_on;
  options.least_noise_factor =
      std::min(1.0, options_.fixed_lag.least_sigma_px / options_.fixed_lag.sigma_px);
  return record_.finalBa(options_.window.priors, options, calibrationInUse());
}

std::vector<CalibrationFinding> Estimator::calibrationFindings() const {
  if (odometry_ && inFlight()) return odometry_->calibrationFindings();
  return last_findings_;
}

StereoInertialCalibration Estimator::calibrationInUse() const {
  const auto in_use = odometry_ && inFlight() ? odometry_->calibrationInUse() : last_calibration_;
  return in_use.value_or(calibration_);
}

}  // namespace etalon
