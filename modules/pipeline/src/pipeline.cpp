#include "etalon/pipeline/pipeline.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "etalon/core/stopwatch.h"
#include "odometry_kinds.h"

namespace etalon {

namespace {

/** After a jump of the clock right behind the start, ns. */
constexpr TimeNs kShortestStep = kNanosecondsPerSecond / 1000;

/** Standard deviations of the biases across a loss, in those that the odometry had. */
constexpr double kBiasCaution = 2.0;

std::string whyNotLocated(const std::optional<TrackedFrame>& tracked,
                          const OdometryOutput& output) {
  if (!tracked) return "the camera repeats its image";
  if (output.observations == 0) return "the images show no landmark";
  return "of " + std::to_string(output.observations) + " landmarks only " +
         std::to_string(output.used) + " are where the motion has them";
}

}  // namespace

Trajectory trajectoryOf(const std::vector<FrameEstimate>& estimates) {
  Trajectory trajectory;
  for (const FrameEstimate& estimate : estimates)
    trajectory.push_back({estimate.t, estimate.nav.T_WB});
  return trajectory;
}

Pipeline::Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
                   PipelineInitializers initializers)
    : calibration_(calibration),
      options_(options),
      noise_(options.imu_noise.apply(calibration.imu.noise)),
      border_(calibration, options.input),
      front_(calibration, options.frontend),
      propagator_(noise_, options.window.gravity_mps2, options.input.max_gap_s),
      record_(calibration,
              {noise_, options.window.gravity_mps2, options.window.odometry.sigma_px,
               options.final_ba ? static_cast<size_t>(options.final_ba_keyframes) : 0}),
      missing_(calibration),
      window_(options.keyframes, options.keyframe_rate_hz),
      starter_(std::move(initializers), options.auto_initializer, options.window, noise_,
               options.windowsGrow()),
      bias_(options.window.priors.mean) {
  options_.fixed_lag.gravity_mps2 = options.window.gravity_mps2;
  options_.fixed_lag.sigma_px = options.window.odometry.sigma_px;
  options_.fixed_lag.imu_noise = noise_;
  if (options.map.enabled && options.odometry_kind != kStereoVisual)
    views_ = std::make_shared<ImageViews>(calibration);
  if (views_ && options.map.relocalize)
    relocalizer_.emplace(calibration, options.map, options.window.odometry.sigma_px, views_);
  front_bias_ = bias_;
  if (options.live) startThreads();
}

Pipeline::~Pipeline() { joinThreads(); }

void Pipeline::estimate(const EstimatorInput& input) {
  std::visit([this](const auto& what) { estimate(what); }, input);
}

void Pipeline::estimate(const ClockJump& jump) {
  remark(std::max(jump.from, jump.to), {missing_.clockJumped(jump.from, jump.to)});
  imu_ = ImuBuffer();
  window_.restart();
  clock_step_s_ += std::abs(secondsBetween(jump.from, jump.to));
}

void Pipeline::estimate(const ImuSample& sample) {
  keepSample(sample, last_frame_, &imu_);
  missing_.sample(sample.t, sample.saturated != 0);
  if (options_.live) noticeMissingImages(sample.t);
  endDeadReckoning(sample.t);
}

void Pipeline::estimate(const FrontFrame& frame) {
  // Held at the border for long, it comes after the end of dead reckoning.
  if (last_frame_ && frame.t <= *last_frame_) return count(InputFault::kFrameFromThePast, frame.t);
  FrameTiming timing;
  timing.frontend_ms = frame.ms;
  Stopwatch watch;
  noticeMissingImages(frame.t);
  no_image_said_ = false;
  const bool said = state_ == PipelineState::kDeadReckoning;
  const TimeNs before = last_frame_.value_or(frame.t);
  const bool imu = before == frame.t || imu_.covers(before, frame.t);
  const int not_located = frames_not_located_;
  const bool was_lost = state_ == PipelineState::kLost;
  last_frame_ = frame.t;
  // Not as the front end sees it: live, frames between may have been dropped.
  if (last_tracked_ && secondsBetween(*last_tracked_, frame.t) > options_.input.max_gap_s)
    window_.restart();
  if (frame.tracked) last_tracked_ = frame.t;
  if (views_ && frame.tracked) views_->show(frame.images.left, frame.images.right);
  follow(frame.t, before, frame.tracked);  // a loss begins a new window
  const bool keyframe = frame.tracked && window_.isKeyframe(frame.t);
  if (was_lost && frames_not_located_ > not_located)
    lost_.goBlind(std::max(secondsBetween(before, frame.t), clock_step_s_), imu);
  if (state_ == PipelineState::kLost)
    estimates_.back().pose_covariance = lost_.covariance(estimates_.back().nav.T_WB.R);
  clock_step_s_ = 0.0;
  const bool located = state_ != PipelineState::kVisual || not_located == frames_not_located_;
  remark(frame.t,
         missing_.frame({frame.t, frame.tracked ? &*frame.tracked : nullptr, imu, located, said}));
  timing.odometry_ms = watch.lapMilliseconds();

  if (frame.tracked && collecting()) {
    window_.add(*frame.tracked, keyframe);
    if (views_) keepWindowImages(frame.images);
    if (keyframe) tryInitialize();
    timing.initialization_ms = watch.lapMilliseconds();
  } else {
    dropSamplesBehind(frame);
  }
  timings_.push_back(timing);
  publish(estimates_.back());
  if (on_tracks_) on_tracks_(frame);
  forgetOld();
}

/** Of the IMU, what neither the next frame nor the window of keyframes needs. */
void Pipeline::dropSamplesBehind(const FrontFrame& frame) {
  if (!collecting()) return imu_.dropBefore(frame.t);
  const TimeNs first = window_.stamps().empty() ? frame.t : window_.stamps().front();
  imu_.dropBefore(first - durationNs(kFarthestTimeOffset));
}

void Pipeline::forgetOld() {
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

void Pipeline::follow(TimeNs t, TimeNs before, const std::optional<TrackedFrame>& tracked) {
  // Not what the front end cut out for the frame: live, frames between may have been dropped.
  std::vector<ImuSample> imu = imu_.between(before, t);
  // The true time across a jump of the clock is unknown: the step of the frames before is taken.
  if (clock_step_s_ > 0.0)
    clock_shift_ += t - before - std::max(frame_step_, kShortestStep);
  else
    frame_step_ = t - before;
  TrackedFrame frame = tracked.value_or(TrackedFrame());
  frame.t = t - clock_shift_;
  for (ImuSample& sample : imu) sample.t -= clock_shift_;
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
OdometryOutput Pipeline::followVisually(const NavState& state, const TrackedFrame& frame) {
  OdometryStart start;
  start.state = state;
  start.state.bias = bias_;
  clock_shift_ = 0;
  odometry_ = makeOdometry(kStereoVisual, calibration_, options_);
  return odometry_->start(start, frame);
}

/** Where dead reckoning has lasted too long and no image comes that would end it, the odometry is
 * lost all the same; no frame has that pose. */
void Pipeline::endDeadReckoning(TimeNs now) {
  constexpr double kFrameMayFollowS = 0.1;  // the samples up to its stamp
  constexpr double kLongerS = 1e-3;
  const bool by_imu = state_ == PipelineState::kInertial || state_ == PipelineState::kDeadReckoning;
  const double left_s = options_.max_dead_reckoning_s - unlocated_s_ + kLongerS;
  if (!by_imu || clock_step_s_ > 0.0 || left_s <= 0.0 ||
      secondsBetween(*last_frame_, now) < left_s + kFrameMayFollowS)
    return;
  const TimeNs t = *last_frame_ + durationNs(left_s);
  noticeMissingImages(t);
  std::vector<ImuSample> imu = imu_.between(*last_frame_, t);
  for (ImuSample& sample : imu) sample.t -= clock_shift_;
  TrackedFrame nothing;
  nothing.t = t - clock_shift_;
  OdometryOutput output = odometry_->process(nothing, imu);
  output.t = t;
  judge(output, nothing);
  if (state_ != PipelineState::kLost) return;
  nothing.t = t;
  followVisually(output.state, nothing);
  last_frame_ = t;
  const std::lock_guard<std::mutex> lock(shared_mutex_);
  propagator_.forgetState();
}

/** What state the pipeline is in after a frame of an odometry that reads the IMU. */
void Pipeline::judge(const OdometryOutput& output, const std::optional<TrackedFrame>& tracked) {
  if (output.unlocated_s == 0.0) {
    enter(PipelineState::kInertial, output.t, "images locate the platform again");
  } else if (output.imu_missing) {
    lose(output, "neither images nor the IMU tell where the platform is");
  } else if (output.unlocated_s > options_.max_dead_reckoning_s) {
    char text[120];
    std::snprintf(text, sizeof text, "no image has located the platform for %.1f s",
                  output.unlocated_s);
    lose(output, text);
  } else {
    enter(PipelineState::kDeadReckoning, output.t, whyNotLocated(tracked, output));
  }
}

void Pipeline::keep(const OdometryOutput& output) {
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

void Pipeline::enter(PipelineState state, TimeNs t, const std::string& reason) {
  if (state == state_) return;
  state_ = state;
  events_.push_back({t, state, reason, false, std::nullopt});
}

void Pipeline::remark(TimeNs t, const std::vector<std::string>& reasons) {
  for (const std::string& reason : reasons)
    events_.push_back({t, state_, reason, true, std::nullopt});
}

void Pipeline::lose(const OdometryOutput& output, const std::string& reason) {
  enter(PipelineState::kLost, output.t, reason);
  record_.interrupt();
  if (relocalizer_) relocalizer_->lost(odometry_->keyframes());
  lost_ = LostPose(output.state, output.covariance);
  const Eigen::Array<double, 15, 1> sigma = output.covariance.diagonal().array().sqrt();
  starter_.knowBiases(output.state.bias,
                      kBiasCaution * sigma.segment<3>(state_index::kGyroBias).maxCoeff(),
                      kBiasCaution * sigma.segment<3>(state_index::kAccelBias).maxCoeff());
  // Across a jump of the clock the odometry went on by the step of the frames before.
  if (clock_step_s_ > 0.0) lost_.goBlind(clock_step_s_, false);
  window_.restart();
}

/** Where a keyframe shows a place from before the last loss. @param frame in the odometry's time */
void Pipeline::relocalize(const TrackedFrame& frame, OdometryOutput* output) {
  if (!relocalizer_ || !relocalizer_->isLooking()) return;
  const SE3 before = output->state.T_WB;
  const auto found = relocalizer_->look(frame, before, odometry_->landmarks());
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

void Pipeline::noteRecognition(TimeNs t, double seconds_ago, const PoseJump& jump) {
  char text[120];
  std::snprintf(text, sizeof text,
                "a place from %.1f s ago is recognized, and the pose is corrected by it",
                seconds_ago);
  events_.push_back({t, state_, text, true, jump});
}

Trajectory Pipeline::smoothedTrajectory() const { return record_.smoothedFlight(trajectory()); }

FinalFlight Pipeline::finalBa(const std::function<bool(int iterations)>& go_on) const {
  TrajectoryBaOptions options;
  options.go_on = go_on;
  options.least_noise_factor =
      std::min(1.0, options_.fixed_lag.least_sigma_px / options_.fixed_lag.sigma_px);
  return record_.finalBa(options_.window.priors, options, calibrationInUse());
}

}  // namespace etalon
