#include "etalon/pipeline/pipeline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/core/aligning_yaw.h"
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

Pipeline::Pipeline(const StereoInertialCalibration& calibration, const PipelineOptions& options,
                   PipelineInitializers initializers)
    : calibration_(calibration),
      options_(options),
      noise_(options.imu_noise.apply(calibration.imu.noise)),
      border_(calibration, options.input),
      tracker_(calibration, options.frontend),
      odometry_(calibration, options.window.odometry),
      window_(options.keyframes, options.keyframe_rate_hz),
      starter_(std::move(initializers), options.auto_initializer, options.window, noise_),
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
      window_.restart();
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
    window_.restart();
  tracked_at_ = frame.t;
  const TrackedFrame tracked = tracker_.track(frame.t, frame.left, frame.right, R_prev_cur);
  repeated_images_.tracked(tracked);
  timing.frontend_ms = watch.lapMilliseconds();

  const bool keyframe = window_.isKeyframe(frame.t);
  const StereoOdometry::FrameResult pose = odometry_.track(tracked, R_prev_cur, keyframe);
  if (!pose.located) ++frames_not_located_;
  trajectory_.push_back({frame.t, pose.T_VB});
  timing.odometry_ms = watch.lapMilliseconds();

  if (collecting()) {
    if (window_.add(tracked)) tryInitialize();
    timing.initialization_ms = watch.lapMilliseconds();
  } else {
    imu_.dropBefore(frame.t);
  }
  timings_.push_back(timing);
}

void Pipeline::tryInitialize() {
  imu_.dropBefore(window_.stamps().front());
  if (!window_.complete()) return;
  const Starter::Outcome outcome = starter_.attempt(window_, [this](const WindowOptions& options) {
    return window_.problem(calibration_, options_.imu_noise, options, imu_);
  });
  if (outcome == Starter::Outcome::kStarts) start(attempts().back());
  if (outcome == Starter::Outcome::kTakesOver) takeOver(attempts().back());
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
  const double yaw = aligningYaw(R);
  const Eigen::Matrix3d R_WA = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
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
  if (!starter_.waitsForMotion()) window_.clear();
}

}  // namespace etalon
