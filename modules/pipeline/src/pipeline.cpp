#include "etalon/pipeline/pipeline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/core/stopwatch.h"

namespace etalon {

std::vector<ParameterSet> PipelineOptions::sections() {
  std::vector<ParameterSet> sets;
  ParameterSet pipeline("pipeline");
  pipeline.add("initializer", &initializer,
               "Name of the initializer plugin (etalon plugins), or auto: see section [auto].");
  pipeline.add("keyframes", &keyframes, {2, 200}, "Keyframes in the initialization window.");
  pipeline.add("keyframe_rate_hz", &keyframe_rate_hz, {0.1, 100.0}, "Keyframes a second.");
  pipeline.add("gravity_mps2", &window.gravity_mps2, {0.1, 100.0}, "Magnitude of gravity, m/s^2.");
  sets.push_back(pipeline);

  ParameterSet automatic(kAutoInitializer);
  auto_initializer.declare(automatic);
  sets.push_back(automatic);

  ParameterSet priors("priors");
  const char* axes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i)
    priors.add(std::string("gyro_bias_mean_") + axes[i] + "_rps", &window.priors.mean.gyro[i],
               {-10.0, 10.0}, "Mean of the gyro bias before any measurement, rad/s.");
  priors.add("gyro_bias_sigma_rps", &window.priors.sigma_gyro_rps, {1e-9, 1e9},
             "Its standard deviation per axis, rad/s.");
  for (int i = 0; i < 3; ++i)
    priors.add(std::string("accel_bias_mean_") + axes[i] + "_mps2", &window.priors.mean.accel[i],
               {-100.0, 100.0}, "Mean of the accelerometer bias before any measurement, m/s^2.");
  priors.add("accel_bias_sigma_mps2", &window.priors.sigma_accel_mps2, {1e-9, 1e9},
             "Its standard deviation per axis, m/s^2.");
  sets.push_back(priors);

  const auto declared = [&sets](const char* name, auto& options) {
    ParameterSet set(name);
    options.declare(set);
    sets.push_back(set);
  };
  declared("input", input);
  declared("imu_noise", imu_noise);
  declared("frontend", frontend);
  declared("odometry", window.odometry);
  declared("vi_ba", window.vi_ba);
  declared("acceptance", window.acceptance);
  return sets;
}

void AutoOptions::declare(ParameterSet& parameters) {
  parameters.add(
      "at_rest", &at_rest,
      "With [pipeline] initializer = auto: the plugin that starts the odometry while the "
      "platform stands still. It must refuse motion with too_much_motion, as static does.");
  parameters.add("moving", &moving,
                 "With [pipeline] initializer = auto: the plugin that takes over when motion "
                 "begins, or starts the odometry in motion.");
  parameters.add("min_motion_share", &min_motion_share, {0.0, 1.0},
                 "Share of the window's time that must be in motion before the one for motion is "
                 "tried; 0: as soon as the window is not at rest.");
}

Pipeline::Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
                   PipelineInitializers initializers)
    : calibration_(calibration),
      options_(options),
      initializers_(std::move(initializers)),
      noise_(options.imu_noise.apply(calibration.imu.noise)),
      border_(calibration, options.input),
      tracker_(calibration, options.frontend),
      selector_(KeyframeSelectorOptions{options.keyframe_rate_hz}),
      odometry_(calibration, options.window.odometry),
      bias_(options.window.priors.mean) {}

Pipeline::~Pipeline() = default;

void Pipeline::add(const ImuSample& sample) {
  border_.add(sample);
  processAdmitted();
}

void Pipeline::add(const StereoFrame& frame) {
  border_.add(frame);
  processAdmitted();
}

void Pipeline::finish() {
  border_.finish();
  processAdmitted();
}

void Pipeline::processAdmitted() {
  while (const std::optional<AdmittedInput> input = border_.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*input)) {
      process(*sample);
    } else if (const auto* frame = std::get_if<StereoFrame>(&*input)) {
      process(*frame);
    } else {
      imu_ = ImuBuffer();
      odometry_.forgetVelocity();
      restartWindow();
    }
  }
}

void Pipeline::process(const ImuSample& sample) {
  imu_.add(sample);
  // Across a gap of this length nothing is integrated: with no frame in sight, no more is needed.
  const TimeNs needed = sample.t - durationNs(options_.input.max_gap_s);
  if (!last_frame_ || *last_frame_ < needed) imu_.dropBefore(needed);
}

/** Rotation of the body from t0 to t1 as the gyro saw it; identity where it saw nothing. */
Eigen::Matrix3d Pipeline::rotationSince(TimeNs t0, TimeNs t1) const {
  if (t0 >= t1 || !imu_.covers(t0, t1)) return Eigen::Matrix3d::Identity();
  return Preintegration(imu_.between(t0, t1), bias_, noise_).deltas().dR;
}

/** After a time that nothing is known of, keyframes before it are of no use for an initialization.
 */
void Pipeline::restartWindow() {
  window_frames_.clear();
  window_keyframes_.clear();
  selector_ = KeyframeSelector(KeyframeSelectorOptions{options_.keyframe_rate_hz});
}

void Pipeline::process(const StereoFrame& frame) {
  FrameTiming timing;
  Stopwatch watch;
  const TimeNs before = last_frame_.value_or(frame.t);
  last_frame_ = frame.t;
  const Eigen::Matrix3d R_prev_cur = rotationSince(tracked_at_.value_or(frame.t), frame.t);
  if (repeated_images_.isRepeated(frame.left, frame.right, imu_.between(before, frame.t))) {
    border_.count(InputFault::kFrameRepeatsImage, frame.t);
    ++frames_not_located_;
    trajectory_.push_back({frame.t, odometry_.predict(frame.t, R_prev_cur)});
    timings_.push_back(timing);
    return;
  }
  if (tracked_at_ && secondsBetween(*tracked_at_, frame.t) > options_.input.max_gap_s)
    restartWindow();
  tracked_at_ = frame.t;
  const TrackedFrame tracked = tracker_.track(frame.t, frame.left, frame.right, R_prev_cur);
  repeated_images_.tracked(tracked);
  timing.frontend_ms = watch.lapMilliseconds();

  const bool keyframe = selector_.isKeyframe(frame.t);
  const StereoOdometry::FrameResult pose = odometry_.track(tracked, R_prev_cur, keyframe);
  if (!pose.located) ++frames_not_located_;
  trajectory_.push_back({frame.t, pose.T_VB});
  timing.odometry_ms = watch.lapMilliseconds();

  if (collecting()) {
    if (keyframe) window_keyframes_.push_back(frame.t);
    if (!window_keyframes_.empty()) window_frames_.push_back(tracked);
    if (keyframe) tryInitialize();
    timing.initialization_ms = watch.lapMilliseconds();
  } else {
    imu_.dropBefore(frame.t);
  }
  timings_.push_back(timing);
}

void Pipeline::dropBeforeWindow() {
  while (static_cast<int>(window_keyframes_.size()) > options_.keyframes)
    window_keyframes_.pop_front();
  while (!window_frames_.empty() && window_frames_.front().t < window_keyframes_.front())
    window_frames_.pop_front();
  imu_.dropBefore(window_keyframes_.front());
}

InitializationProblem Pipeline::windowProblem(const WindowOptions& options) const {
  std::vector<TrackedFrame> frames(window_frames_.begin(), window_frames_.end());
  std::vector<int> indices;
  for (size_t i = 0; i < frames.size(); ++i)
    if (std::binary_search(window_keyframes_.begin(), window_keyframes_.end(), frames[i].t))
      indices.push_back(static_cast<int>(i));
  ImuBuffer imu(imu_.between(window_keyframes_.front(), window_keyframes_.back()));
  const ImuNoiseDensities noise = options_.imu_noise.apply(calibration_.imu.noise, imu.samples());
  return makeProblem(calibration_, noise, options, std::move(frames), std::move(indices),
                     std::move(imu));
}

void Pipeline::tryInitialize() {
  dropBeforeWindow();
  if (static_cast<int>(window_keyframes_.size()) < options_.keyframes) return;
  const WindowOptions options = waits_for_motion_ ? handoverOptions() : options_.window;
  const InitializationProblem problem = windowProblem(options);
  if (waits_for_motion_ ? !isInMotion(problem) : initializers_.at_rest && startsAtRest(problem))
    return;
  InitializationAttempt attempt =
      attemptInitialization(problem, *initializers_.initializer, options);
  if (initializers_.at_rest) attempt.initializer = initializers_.name;
  keep(std::move(attempt));
  if (!attempts_.back().decision.accepted) return;
  if (waits_for_motion_)
    takeOver(attempts_.back());
  else
    start(attempts_.back());
}

/** Adds the attempt, and lightens the one that now is too old to be kept whole. */
void Pipeline::keep(InitializationAttempt attempt) {
  attempts_.push_back(std::move(attempt));
  if (attempts_.size() <= kDetailedAttempts) return;
  InitializationAttempt& old = attempts_[attempts_.size() - 1 - kDetailedAttempts];
  if (!old.decision.accepted) old.dropEstimates();
}

/** True if the window is at rest: then the odometry runs, and there is nothing else to do. */
bool Pipeline::startsAtRest(const InitializationProblem& problem) {
  InitializationAttempt attempt =
      attemptInitialization(problem, *initializers_.at_rest, options_.window);
  attempt.initializer = initializers_.at_rest_name;
  keep(std::move(attempt));
  if (!attempts_.back().decision.accepted) return false;
  waits_for_motion_ = true;
  last_rest_ = attempts_.back().t;
  start(attempts_.back());
  return true;
}

/** Whether the window is known to move, and long enough. A window of which the at-rest initializer
 * cannot tell is an attempt, so that the reason for waiting is seen. */
bool Pipeline::isInMotion(const InitializationProblem& problem) {
  InitializationResult result = initializers_.at_rest->initialize(problem);
  const TimeNs now = window_keyframes_.back();
  if (result.status == InitializationStatus::kTooMuchMotion)
    return secondsBetween(last_rest_, now) >= options_.auto_initializer.min_motion_share *
                                                  secondsBetween(window_keyframes_.front(), now);
  last_rest_ = now;
  if (result.ok()) return false;
  InitializationAttempt attempt;
  attempt.t = now;
  attempt.initializer = initializers_.at_rest_name;
  attempt.keyframes.assign(window_keyframes_.begin(), window_keyframes_.end());
  attempt.decision.status = result.status;
  attempt.decision.reason = result.reason;
  attempt.decision.value = result.reason_value;
  attempt.init = std::move(result);
  keep(std::move(attempt));
  return false;
}

/** What the start learnt of the gyro bias is the prior, unless the windows have measurements in
 * common, which would count twice. Of the accelerometer's bias it learnt nothing apart from tilt.
 */
WindowOptions Pipeline::handoverOptions() const {
  WindowOptions options = options_.window;
  if (window_keyframes_.front() < initialized_at_) return options;
  const double walk = noise_.gyro_random_walk *
                      std::sqrt(secondsBetween(initialized_at_, window_keyframes_.back()));
  const double sigma = std::hypot(sigma_gyro_bias_, walk);
  if (!(sigma < options.priors.sigma_gyro_rps)) return options;
  options.priors.mean.gyro = bias_.gyro;
  options.priors.sigma_gyro_rps = sigma;
  return options;
}

void Pipeline::start(const InitializationAttempt& attempt) {
  // The last keyframe is the current frame: there the visual frame is tied to the world.
  const SE3 T_WV = attempt.poses().back() * odometry_.pose().inverse();
  for (StampedPose& pose : trajectory_) pose.T_WB = T_WV * pose.T_WB;
  adopt(attempt, SE3());
  state_ = PipelineState::kInitialized;
  initialized_at_ = attempt.t;
}

void Pipeline::takeOver(const InitializationAttempt& attempt) {
  // The attempt has a world A of its own. The rotation about z that brings its current pose nearest
  // to the odometry's: the trace of Rz(yaw)^T R_WB R_AB^T is greatest.
  const SE3& T_WB = odometry_.pose();
  const SE3 T_AB = attempt.poses().back();
  const Eigen::Matrix3d R = T_WB.R * T_AB.R.transpose();
  const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  const Eigen::Matrix3d R_WA = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  waits_for_motion_ = false;
  handed_over_at_ = attempt.t;
  adopt(attempt, {R_WA, T_WB.t - R_WA * T_AB.t});
}

/** Moves the odometry to the attempt's estimate, whose world is A. */
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
  sigma_gyro_bias_ = attempt.sigmaGyroBias();
  if (waits_for_motion_) return;
  window_frames_.clear();
  window_keyframes_.clear();
}

}  // namespace etalon
