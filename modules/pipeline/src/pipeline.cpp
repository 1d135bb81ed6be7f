#include "etalon/pipeline/pipeline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "etalon/core/angles.h"
#include "etalon/core/stopwatch.h"
#include "etalon/pipeline/odometry_start.h"
#include "odometry_kinds.h"

namespace etalon {

namespace {

/** After a jump of the clock right behind the start, ns. */
constexpr TimeNs kShortestStep = kNanosecondsPerSecond / 1000;

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
      front_(calibration, options.frontend, options.input.max_gap_s),
      propagator_(noise_, options.window.gravity_mps2, options.input.max_gap_s),
      odometry_(calibration, options.window.odometry),
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
    views_ = std::make_shared<ImageViews>();
  front_bias_ = bias_;
  if (options.live) startThreads();
}

Pipeline::~Pipeline() { joinThreads(); }

void Pipeline::estimate(const EstimatorInput& input) {
  std::visit([this](const auto& what) { estimate(what); }, input);
}

void Pipeline::estimate(const ClockJump& jump) {
  remark(jump.to, {missing_.clockJumped(jump.from, jump.to)});
  imu_ = ImuBuffer();
  odometry_.forgetVelocity();
  window_.restart();
  clock_jumped_ = true;
}

void Pipeline::estimate(const ImuSample& sample) {
  keepSample(sample, last_frame_, &imu_);
  missing_.sample(sample.t, sample.saturated != 0);
  if (options_.live) noticeMissingImages(sample.t);
}

void Pipeline::estimate(const FrontFrame& frame) {
  FrameTiming timing;
  timing.frontend_ms = frame.ms;
  Stopwatch watch;
  noticeMissingImages(frame.t);
  const bool said = state_ == PipelineState::kDeadReckoning;
  const TimeNs before = last_frame_.value_or(frame.t);
  const bool imu = before == frame.t || imu_.covers(before, frame.t);
  const int not_located = frames_not_located_;
  last_frame_ = frame.t;
  if (frame.after_gap) window_.restart();
  if (views_ && frame.tracked) views_->show(frame.images.left, frame.images.right);
  const bool keyframe = frame.tracked && window_.isKeyframe(frame.t);
  if (inertial_)
    followInertially(frame.t, before, frame.tracked);
  else
    follow(frame.t, frame.tracked, frame.R_prev_cur, keyframe);
  const bool located = state_ != PipelineState::kVisual || not_located == frames_not_located_;
  remark(frame.t,
         missing_.frame({frame.t, frame.tracked ? &*frame.tracked : nullptr, imu, located, said}));
  timing.odometry_ms = watch.lapMilliseconds();

  if (frame.tracked && collecting()) {
    window_.add(*frame.tracked, keyframe);
    if (views_) keepWindowImages(frame.images);
    if (keyframe) tryInitialize();
    timing.initialization_ms = watch.lapMilliseconds();
  } else if (!collecting()) {
    imu_.dropBefore(frame.t);
  }
  timings_.push_back(timing);
  publish(estimates_.back());
  if (on_tracks_) on_tracks_(frame);
  forgetOld();
}

void Pipeline::forgetOld() {
  const size_t keep = options_.history_frames;
  if (keep == 0 || estimates_.size() < 2 * keep) return;
  const std::ptrdiff_t old = estimates_.size() - keep;
  estimates_.erase(estimates_.begin(), estimates_.begin() + old);
  timings_.erase(timings_.begin(), timings_.begin() + old);
  record_.forgetBefore(estimates_.front().t);
}

/** Stereo odometry. */
void Pipeline::follow(TimeNs t, const std::optional<TrackedFrame>& tracked,
                      const Eigen::Matrix3d& R_prev_cur, bool keyframe) {
  FrameEstimate estimate;
  estimate.t = t;
  if (state_ == PipelineState::kWaiting) enter(PipelineState::kVisual, t, "the first images came");
  bool located = false;
  if (tracked) {
    const StereoOdometry::FrameResult pose = odometry_.track(*tracked, R_prev_cur, keyframe);
    estimate.nav.T_WB = pose.T_VB;
    located = pose.located;
  } else {
    estimate.nav.T_WB = odometry_.predict(t, R_prev_cur);
  }
  if (!located) ++frames_not_located_;
  estimate.state = state_;
  estimates_.push_back(estimate);
}

/** Fixed-lag odometry. */
void Pipeline::followInertially(TimeNs t, TimeNs before,
                                const std::optional<TrackedFrame>& tracked) {
  // Not what the front end cut out for the frame: live, frames between may have been dropped.
  std::vector<ImuSample> imu = imu_.between(before, t);
  // The true time across a jump of the clock is unknown: the step of the frames before is taken.
  if (clock_jumped_)
    clock_shift_ += t - before - std::max(frame_step_, kShortestStep);
  else
    frame_step_ = t - before;
  clock_jumped_ = false;
  TrackedFrame frame = tracked.value_or(TrackedFrame());
  frame.t = t - clock_shift_;
  for (ImuSample& sample : imu) sample.t -= clock_shift_;
  OdometryOutput output = inertial_->process(frame, imu);
  record_.add(t, frame, imu, output, inertial_.get());
  remark(t, output.remarks);
  output.t = frame.t = t;
  const bool located = output.unlocated_s == 0.0;
  if (!located) ++frames_not_located_;
  if (located) {
    enter(PipelineState::kInertial, t, "images locate the platform again");
  } else if (output.imu_missing) {
    lose(output, "neither images nor the IMU tell where the platform is");
  } else if (output.unlocated_s > options_.max_dead_reckoning_s) {
    char text[120];
    std::snprintf(text, sizeof text, "no image has located the platform for %.1f s",
                  output.unlocated_s);
    lose(output, text);
  } else {
    enter(PipelineState::kDeadReckoning, t, whyNotLocated(tracked, output));
  }
  keep(output);
  if (state_ == PipelineState::kLost) odometry_.begin(frame, output.state.T_WB, output.state.v_WB);
}

void Pipeline::keep(const OdometryOutput& output) {
  FrameEstimate estimate;
  estimate.t = output.t;
  estimate.state = state_;
  estimate.nav = output.state;
  estimate.pose_covariance = output.covariance.topLeftCorner<6, 6>();
  estimate.motion_variance = output.covariance.diagonal().tail<9>();
  bias_ = output.state.bias;
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

/** Stereo odometry begins anew, at the predicted pose, until a start is accepted. */
void Pipeline::lose(const OdometryOutput& output, const std::string& reason) {
  enter(PipelineState::kLost, output.t, reason);
  inertial_.reset();
  record_.interrupt();
  lost_covariance_ = output.covariance.topLeftCorner<6, 6>();
  window_.restart();
}

void Pipeline::tryInitialize() {
  imu_.dropBefore(window_.stamps().front());
  if (keyframesCollected() < (options_.windowsGrow() ? options_.min_keyframes : options_.keyframes))
    return;
  const Starter::Outcome outcome = starter_.attempt(window_, [this](const WindowOptions& options) {
    return window_.problem(calibration_, options_.imu_noise, options, imu_);
  });
  if (outcome == Starter::Outcome::kRefused) return;
  const InitializationAttempt& attempt = attempts().back();
  if (outcome == Starter::Outcome::kTakesOver) {
    handed_over_at_ = attempt.t;
    adopt(attempt, keepingYawAndPosition(attempt));
  } else if (state_ == PipelineState::kLost) {
    startAgain(attempt);
  } else {
    start(attempt);
  }
}

void Pipeline::start(const InitializationAttempt& attempt) {
  initialized_at_ = attempt.t;
  std::optional<OdometryOutput> inertial;
  if (auto odometry = makeOdometry(calibration_, options_, views_))
    inertial = startInertially(std::move(odometry), attempt, SE3());
  // The last keyframe is the current frame: there the visual frame is tied to the world.
  const SE3 T_WB = inertial ? inertial->state.T_WB : attempt.poses().back();
  const SE3 T_WV = T_WB * odometry_.pose().inverse();
  for (FrameEstimate& estimate : estimates_) estimate.nav.T_WB = T_WV * estimate.nav.T_WB;
  if (inertial)
    replaceLast(*inertial);
  else
    adopt(attempt, SE3());
}

void Pipeline::startAgain(const InitializationAttempt& attempt) {
  const SE3 before = estimates_.back().nav.T_WB;
  replaceLast(startInertially(makeOdometry(calibration_, options_, views_), attempt,
                              keepingYawAndPosition(attempt)));
  PoseJump jump;
  jump.T_before_after = before.inverse() * estimates_.back().nav.T_WB;
  jump.covariance = lost_covariance_;
  events_.back().jump = jump;
}

/** The odometry begins at the window's first keyframe and runs through the window's frames. */
OdometryOutput Pipeline::startInertially(std::unique_ptr<Odometry> odometry,
                                         const InitializationAttempt& attempt, const SE3& T_WA) {
  clock_shift_ = 0;
  clock_jumped_ = false;
  inertial_ = std::move(odometry);
  const std::deque<TrackedFrame>& frames = window_.frames();
  showWindowImage(frames.front().t);
  OdometryOutput output =
      inertial_->start(odometryStart(attempt, T_WA, options_.window.priors), frames.front());
  record_.add(output.t, frames.front(), {}, output, inertial_.get());
  for (size_t i = 1; i < frames.size(); ++i) {
    const std::vector<ImuSample> imu = imu_.between(frames[i - 1].t, frames[i].t);
    showWindowImage(frames[i].t);
    output = inertial_->process(frames[i], imu);
    record_.add(output.t, frames[i], imu, output, inertial_.get());
  }
  window_.clear();
  window_images_.clear();
  starter_.endWaitForMotion();
  const std::string by =
      attempt.initializer.empty() ? "a start was" : attempt.initializer + "'s start was";
  enter(PipelineState::kInertial, output.t, by + " accepted");
  return output;
}

/** The map takes its views from the window's frames, too, when the odometry runs through them. */
void Pipeline::keepWindowImages(const StereoFrame& frame) {
  StereoFrame& kept = window_images_[frame.t];
  kept.left = frame.left.clone();
  kept.right = frame.right.clone();
  const std::deque<TrackedFrame>& frames = window_.frames();
  const auto first = frames.empty() ? window_images_.end() : window_images_.find(frames.front().t);
  window_images_.erase(window_images_.begin(), first);
}

void Pipeline::showWindowImage(TimeNs t) {
  if (!views_) return;
  const StereoFrame& frame = window_images_.at(t);
  views_->show(frame.left, frame.right);
}

/** The last pose is the fixed-lag odometry's first. */
void Pipeline::replaceLast(const OdometryOutput& output) {
  estimates_.pop_back();
  keep(output);
}

Trajectory Pipeline::smoothedTrajectory() const {
  return carriedAlong(trajectory(), record_.smoothed());
}

FinalFlight Pipeline::finalBa() const {
  TrajectoryBaOptions options;
  options.least_noise_factor =
      std::min(1.0, options_.fixed_lag.least_sigma_px / options_.fixed_lag.sigma_px);
  return record_.finalBa(options_.window.priors, options, calibrationInUse());
}

/** From the attempt's world A to the one that the odometry is in: the current pose keeps yaw and
 * position. */
SE3 Pipeline::keepingYawAndPosition(const InitializationAttempt& attempt) const {
  // The rotation about z that brings the attempt's current pose nearest to the odometry's: the
  // trace of Rz(yaw)^T R_WB R_AB^T is greatest.
  const SE3& T_WB = odometry_.pose();
  const SE3 T_AB = attempt.poses().back();
  const Eigen::Matrix3d R = T_WB.R * T_AB.R.transpose();
  const double yaw = aligningYaw(R);
  const Eigen::Matrix3d R_WA = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return {R_WA, T_WB.t - R_WA * T_AB.t};
}

/** Moves the stereo odometry to the attempt's estimate, whose world is A. */
void Pipeline::adopt(const InitializationAttempt& attempt, const SE3& T_WA) {
  const std::vector<SE3> poses = attempt.poses();
  odometry_.transform(T_WA * poses.back() * odometry_.pose().inverse());
  Trajectory keyframes;
  for (size_t k = 0; k < attempt.keyframes.size(); ++k)
    keyframes.push_back({attempt.keyframes[k], T_WA * poses[k]});
  std::map<LandmarkId, Eigen::Vector3d> landmarks;
  for (const auto& [id, p_A] : attempt.landmarks) landmarks[id] = T_WA * p_A;
  odometry_.adopt(keyframes, landmarks);
  bias_ = attempt.bias();
  if (!starter_.waitsForMotion()) window_.clear();
}

}  // namespace etalon
