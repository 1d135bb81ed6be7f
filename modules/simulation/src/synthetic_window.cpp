#include "etalon/simulation/synthetic_window.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/preintegration.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/track_synthesis.h"

namespace etalon::testing {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const char* toString(Motion motion) {
  switch (motion) {
    case Motion::kGentle:
      return "gentle";
    case Motion::kAggressive:
      return "aggressive";
    case Motion::kCircle:
      return "circle";
    case Motion::kPureRotation:
      return "pure_rotation";
    case Motion::kConstantVelocity:
      return "constant_velocity";
    case Motion::kStandstill:
      return "standstill";
  }
  return "unknown";
}

namespace {

/** Angular rate in B (rad/s) and acceleration in W (m/s^2) as functions of time. */
class MotionModel {
 public:
  MotionModel(Motion motion, std::mt19937* rng) : motion_(motion) {
    std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI), frequency(0.5, 1.5);
    for (int i = 0; i < 6; ++i) {
      phase_[i] = phase(*rng);
      omega_[i] = 2.0 * M_PI * frequency(*rng) * (motion == Motion::kAggressive ? 0.9 : 0.4);
    }
  }

  Vector3d gyro(double t) const {
    switch (motion_) {
      case Motion::kGentle:
        return 0.3 * waves(t, 0);
      case Motion::kAggressive:
        return 1.5 * waves(t, 0);
      case Motion::kCircle:
        return {0.0, 0.0, 1.0};
      case Motion::kPureRotation:
        return 1.0 * waves(t, 0);
      default:
        return Vector3d::Zero();
    }
  }

  Vector3d accel(double t) const {
    switch (motion_) {
      case Motion::kGentle:
        return 1.0 * waves(t, 3);
      case Motion::kAggressive:
        return 5.0 * waves(t, 3);
      case Motion::kCircle:  // radius 1 m, 1 rad/s
        return {-std::cos(t), -std::sin(t), 0.0};
      default:
        return Vector3d::Zero();
    }
  }

  Vector3d initialVelocity() const {
    if (motion_ == Motion::kCircle) return {0.0, 1.0, 0.0};
    if (motion_ == Motion::kConstantVelocity) return {0.8, 0.3, 0.1};
    return Vector3d::Zero();
  }

 private:
  Vector3d waves(double t, int first) const {
    Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = std::sin(omega_[first + i] * t + phase_[first + i]);
    return v;
  }
  Motion motion_;
  double phase_[6], omega_[6];
};

std::vector<ImuSample> exactImu(const SyntheticWindowOptions& options, const MotionModel& model,
                                const Matrix3d& R_WB0, double duration_s) {
  std::vector<ImuSample> samples;
  Matrix3d R_WB = R_WB0;
  const Vector3d g_W(0, 0, -options.gravity_mps2);
  // To the end or just beyond it; rounding alone adds no sample.
  const int count = static_cast<int>(std::ceil(duration_s * options.imu_rate_hz - 1e-6)) + 1;
  for (int i = 0; i < count; ++i) {
    const double t = i / options.imu_rate_hz;
    ImuSample s;
    s.t = options.start + durationNs(t);
    s.gyro = model.gyro(t);
    s.accel = R_WB.transpose() * (model.accel(t) - g_W);
    samples.push_back(s);
    const double dt = 1.0 / options.imu_rate_hz;
    R_WB = R_WB * expSO3(0.5 * (s.gyro + model.gyro(t + dt)) * dt);
  }
  return samples;
}

/** Landmarks on a sphere around the middle of the path. */
std::vector<Vector3d> landmarksOnSphere(const Eigen::AlignedBox3d& path, int count,
                                        double distance_m, std::mt19937* rng) {
  std::normal_distribution<double> normal;
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    Vector3d direction;
    for (int a = 0; a < 3; ++a) direction[a] = normal(*rng);
    points.emplace_back(path.center() + distance_m * direction.normalized());
  }
  return points;
}

/** Landmarks dense enough that a frame sees about the number wanted. */
std::vector<Vector3d> makeLandmarks(const std::vector<StampedState>& states,
                                    const SyntheticWindowOptions& options, std::mt19937* rng) {
  const int count = 12 * options.landmarks;  // the camera sees about a twelfth of the walls
  std::vector<Vector3d> positions;
  Eigen::AlignedBox3d path;
  for (const StampedState& s : states) {
    positions.push_back(s.T_WB.t);
    path.extend(s.T_WB.t);
  }
  if (options.landmark_distance_m > 0.0)
    return landmarksOnSphere(path, count, options.landmark_distance_m, rng);
  return scatterLandmarks(positions, count, options.seed, 3.0);
}

void moveWorld(const SE3& T_NewOld, std::vector<StampedState>* states,
               std::vector<Vector3d>* landmarks) {
  if (T_NewOld.R.isIdentity(0.0) && T_NewOld.t.isZero(0.0)) return;
  for (StampedState& s : *states) {
    s.T_WB = T_NewOld * s.T_WB;
    s.v_WB = T_NewOld.R * s.v_WB;
  }
  for (Vector3d& p_W : *landmarks) p_W = T_NewOld * p_W;
}

ImuSynthesisOptions imuErrors(const SyntheticWindowOptions& options,
                              const ImuNoiseDensities& noise) {
  ImuSynthesisOptions errors;
  errors.rate_hz = options.imu_rate_hz;
  errors.noise = noise;
  errors.noise.gyro_noise_density *= options.gyro_noise_factor;
  errors.noise.accel_noise_density *= options.accel_noise_factor;
  errors.bias_walk = false;
  errors.initial_bias = options.bias;
  errors.seed = options.seed;
  return errors;
}

TrackSynthesisOptions trackErrors(const SyntheticWindowOptions& options, size_t landmarks) {
  TrackSynthesisOptions errors;
  errors.sigma_px = options.sigma_px;
  errors.outlier_ratio = options.outlier_share;
  errors.max_tracks = landmarks;
  errors.border_px = 1.0;
  errors.min_depth_m = 0.0;
  errors.max_depth_m = std::numeric_limits<double>::infinity();
  errors.seed = options.seed;
  return errors;
}

}  // namespace

std::vector<const TrackedFrame*> SyntheticWindow::keyframes() const {
  std::vector<const TrackedFrame*> result;
  for (const int i : keyframe_indices) result.push_back(&frames[i]);
  return result;
}

SyntheticWindow makeSyntheticWindow(const SyntheticWindowOptions& options) {
  std::mt19937 rng(options.seed);
  SyntheticWindow window;
  window.calibration = eurocCalibration();
  window.bias = options.bias;
  const MotionModel model(options.motion, &rng);
  StampedState start;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  start.t = options.start;
  // Any attitude: nothing may depend on a level start.
  start.T_WB.R = expSO3(Vector3d(0.5 * unit(rng), 0.5 * unit(rng), 3.0 * unit(rng)));
  start.v_WB = model.initialVelocity();

  const int frame_count = (options.keyframes - 1) * options.frames_per_keyframe + 1;
  const double frame_s = 1.0 / (options.keyframe_rate_hz * options.frames_per_keyframe);
  const ImuBuffer exact(exactImu(options, model, start.T_WB.R, (frame_count - 1) * frame_s));
  const ImuNoiseDensities noise = window.calibration.imu.noise;
  const Vector3d g_W(0, 0, -options.gravity_mps2);
  std::vector<StampedState> states{start};
  for (int i = 1; i < frame_count; ++i) {
    const StampedState& last = states.back();
    const TimeNs t = options.start + durationNs(i * frame_s);
    states.emplace_back(
        t, Preintegration(exact.between(last.t, t), ImuBias(), noise).predict(last, g_W));
  }
  window.landmarks = makeLandmarks(states, options, &rng);
  moveWorld(SE3(expSO3(Vector3d(0, 0, options.world_yaw_rad)), options.world_origin), &states,
            &window.landmarks);
  window.imu = ImuBuffer(withImuErrors(exact.samples(), imuErrors(options, noise)).samples);
  Trajectory poses;
  for (const StampedState& s : states) poses.push_back({s.t, s.T_WB});
  window.frames = simulateTracks(poses, window.calibration, window.landmarks,
                                 trackErrors(options, window.landmarks.size()));
  for (int i = 0; i < frame_count; i += options.frames_per_keyframe) {
    window.keyframe_indices.push_back(i);
    window.truth.push_back(states[i]);
    window.truth.back().bias = options.bias;
  }
  return window;
}

}  // namespace etalon::testing
