#include "etalon/contract/synthetic_window.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/pipeline/window_initialization.h"

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

StereoInertialCalibration eurocCalibration() {
  StereoInertialCalibration calibration;
  const auto camera = [](const std::vector<double>& intrinsics,
                         const std::vector<double>& coefficients) {
    return CameraModel("pinhole", "radial-tangential", 752, 480, intrinsics, coefficients);
  };
  calibration.cameras[0].model = camera({458.654, 457.296, 367.215, 248.375},
                                        {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  calibration.cameras[1].model = camera({457.587, 456.134, 379.999, 255.238},
                                        {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05});
  Matrix3d R0, R1;
  R0 << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.0257744366974, 0.00375618835797, 0.999660727178;
  R1 << 0.0125552670891, -0.999755099723, 0.0182237714554, 0.999598781151, 0.0130119051815,
      0.0251588363115, -0.0253898008918, 0.0179005838253, 0.999517347078;
  calibration.cameras[0].T_BC =
      SE3(nearestRotation(R0), Vector3d(-0.0216401454975, -0.064676986768, 0.00981073058949));
  calibration.cameras[1].T_BC =
      SE3(nearestRotation(R1), Vector3d(-0.0198435579556, 0.0453689425024, 0.00786212447038));
  return calibration;
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
  // To the end or just beyond it; what is off by rounding alone is no further sample.
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

struct State {
  SE3 T_WB;
  Vector3d v_WB;
};

State propagated(const State& s, const Preintegration& p, double gravity) {
  const Vector3d g_W(0, 0, -gravity);
  State next;
  next.T_WB.R = nearestRotation(s.T_WB.R * p.deltas().dR);
  next.T_WB.t = s.T_WB.t + s.v_WB * p.dt() + 0.5 * g_W * p.dt() * p.dt() + s.T_WB.R * p.deltas().dp;
  next.v_WB = s.v_WB + g_W * p.dt() + s.T_WB.R * p.deltas().dv;
  return next;
}

/** Landmarks on the walls of a room around the path or on a sphere, dense enough that a frame sees
 * about the number wanted. */
std::vector<Vector3d> makeLandmarks(const std::vector<State>& states,
                                    const SyntheticWindowOptions& options, std::mt19937* rng) {
  const int count = 12 * options.landmarks;  // the camera sees about a twelfth of the walls
  Vector3d lo = states[0].T_WB.t, hi = lo;
  for (const State& s : states) {
    lo = lo.cwiseMin(s.T_WB.t);
    hi = hi.cwiseMax(s.T_WB.t);
  }
  lo.array() -= 3.0;
  hi.array() += 3.0;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Vector3d> points;
  if (options.landmark_distance_m > 0.0) {
    std::normal_distribution<double> normal;
    for (int i = 0; i < count; ++i) {
      Vector3d direction;
      for (int a = 0; a < 3; ++a) direction[a] = normal(*rng);
      points.emplace_back(0.5 * (lo + hi) + options.landmark_distance_m * direction.normalized());
    }
    return points;
  }
  for (int i = 0; i < count; ++i) {
    Vector3d p;
    for (int a = 0; a < 3; ++a) p[a] = lo[a] + (hi[a] - lo[a]) * unit(*rng);
    const int axis = std::min(2, static_cast<int>(3.0 * unit(*rng)));
    p[axis] = unit(*rng) < 0.5 ? lo[axis] : hi[axis];
    points.push_back(p);
  }
  return points;
}

void moveWorld(const SE3& T_NewOld, std::vector<State>* states, std::vector<Vector3d>* landmarks) {
  if (T_NewOld.R.isIdentity(0.0) && T_NewOld.t.isZero(0.0)) return;
  for (State& s : *states) {
    s.T_WB = T_NewOld * s.T_WB;
    s.v_WB = T_NewOld.R * s.v_WB;
  }
  for (Vector3d& p_W : *landmarks) p_W = T_NewOld * p_W;
}

void addNoise(const SyntheticWindowOptions& options, const ImuNoiseDensities& noise,
              std::mt19937* rng, std::vector<ImuSample>* samples) {
  std::normal_distribution<double> normal;
  const double root_rate = std::sqrt(options.imu_rate_hz);
  for (ImuSample& s : *samples)
    for (int a = 0; a < 3; ++a) {
      s.gyro[a] += options.bias.gyro[a] +
                   options.gyro_noise_factor * noise.gyro_noise_density * root_rate * normal(*rng);
      s.accel[a] += options.bias.accel[a] + options.accel_noise_factor * noise.accel_noise_density *
                                                root_rate * normal(*rng);
    }
}

TrackedFrame observe(const SyntheticWindowOptions& options, const SyntheticWindow& window,
                     const State& state, TimeNs t, std::mt19937* rng) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto noisy = [&](Eigen::Vector2d pixel) {
    pixel.x() += options.sigma_px * normal(*rng);
    pixel.y() += options.sigma_px * normal(*rng);
    if (std::abs(unit(*rng)) < options.outlier_share) {
      const double angle = M_PI * unit(*rng), radius = 27.5 + 22.5 * unit(*rng);
      pixel += radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    return pixel;
  };
  TrackedFrame frame;
  frame.t = t;
  const SE3 T_BW = state.T_WB.inverse();
  for (size_t l = 0; l < window.landmarks.size(); ++l) {
    const Vector3d p_B = T_BW * window.landmarks[l];
    std::optional<Eigen::Vector2d> pixel[2];
    for (size_t c = 0; c < 2; ++c) {
      const CameraCalibration& camera = window.calibration.cameras[c];
      pixel[c] = camera.model.project(camera.T_BC.inverse() * p_B);
      if (pixel[c] && !camera.model.inImage(*pixel[c], 1.0)) pixel[c].reset();
    }
    if (!pixel[0]) continue;
    Observation o;
    o.id = static_cast<LandmarkId>(l);
    o.left = noisy(*pixel[0]);
    o.has_right = pixel[1].has_value();
    if (o.has_right) o.right = noisy(*pixel[1]);
    frame.observations.push_back(o);
  }
  return frame;
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
  State state;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  // Any attitude: nothing may depend on a level start.
  state.T_WB.R = expSO3(Vector3d(0.5 * unit(rng), 0.5 * unit(rng), 3.0 * unit(rng)));
  state.v_WB = model.initialVelocity();

  const int frame_count = (options.keyframes - 1) * options.frames_per_keyframe + 1;
  const double frame_s = 1.0 / (options.keyframe_rate_hz * options.frames_per_keyframe);
  std::vector<ImuSample> samples =
      exactImu(options, model, state.T_WB.R, (frame_count - 1) * frame_s);
  const ImuBuffer exact(samples);
  const ImuNoiseDensities noise = window.calibration.imu.noise;
  std::vector<State> states{state};
  std::vector<TimeNs> stamps{options.start};
  for (int i = 1; i < frame_count; ++i) {
    stamps.push_back(options.start + durationNs(i * frame_s));
    const size_t j = i;
    states.push_back(propagated(
        states.back(), Preintegration(exact.between(stamps[j - 1], stamps[j]), ImuBias(), noise),
        options.gravity_mps2));
  }
  window.landmarks = makeLandmarks(states, options, &rng);
  moveWorld(SE3(expSO3(Vector3d(0, 0, options.world_yaw_rad)), options.world_origin), &states,
            &window.landmarks);
  addNoise(options, noise, &rng, &samples);
  window.imu = ImuBuffer(samples);
  for (int i = 0; i < frame_count; ++i) {
    const size_t j = i;
    window.frames.push_back(observe(options, window, states[j], stamps[j], &rng));
    if (i % options.frames_per_keyframe != 0) continue;
    window.keyframe_indices.push_back(i);
    window.truth.push_back({stamps[j], states[j].T_WB, states[j].v_WB});
  }
  return window;
}

InitializationProblem makeProblem(const SyntheticWindow& window,
                                  const SyntheticWindowOptions& options) {
  ImuNoiseOptions factors;
  factors.gyro_noise_factor = factors.accel_noise_factor = options.assumed_noise_factor;
  WindowOptions window_options;
  window_options.gravity_mps2 = options.gravity_mps2;
  window_options.priors = options.priors;
  window_options.odometry.sigma_px = options.assumed_sigma_px;
  return etalon::makeProblem(window.calibration, factors.apply(window.calibration.imu.noise),
                             window_options, window.frames, window.keyframe_indices, window.imu);
}

WindowErrors errorsOf(const std::vector<StampedState>& states, const ImuBias& bias,
                      const SyntheticWindow& window) {
  WindowErrors e;
  const size_t n = states.size();
  Vector3d mean_estimate = Vector3d::Zero(), mean_truth = Vector3d::Zero();
  for (size_t k = 0; k < n; ++k) {
    mean_estimate += states[k].T_WB.t / static_cast<double>(n);
    mean_truth += window.truth[k].T_WB.t / static_cast<double>(n);
  }
  Matrix3d H = Matrix3d::Zero();
  for (size_t k = 0; k < n; ++k) {
    const SE3 &a = states[k].T_WB, &b = window.truth[k].T_WB;
    H += (b.t - mean_truth) * (a.t - mean_estimate).transpose();
    const Vector3d dv = a.R.transpose() * states[k].v_WB - b.R.transpose() * window.truth[k].v_WB;
    e.velocity_mps += dv.squaredNorm() / static_cast<double>(n);
    if (k == 0) continue;
    const Matrix3d da = states[k - 1].T_WB.R.transpose() * a.R;
    const Matrix3d db = window.truth[k - 1].T_WB.R.transpose() * b.R;
    e.rre_deg +=
        std::pow(degrees(logSO3(da.transpose() * db).norm()), 2) / static_cast<double>(n - 1);
  }
  const Matrix3d R = nearestRotation(H);
  for (size_t k = 0; k < n; ++k)
    e.ate_m += (R * (states[k].T_WB.t - mean_estimate) - (window.truth[k].T_WB.t - mean_truth))
                   .squaredNorm() /
               static_cast<double>(n);
  e.rre_deg = std::sqrt(e.rre_deg);
  e.ate_m = std::sqrt(e.ate_m);
  e.velocity_mps = std::sqrt(e.velocity_mps);
  e.gravity_deg = degrees(
      angleBetween(states[0].T_WB.R.row(2).transpose(), window.truth[0].T_WB.R.row(2).transpose()));
  e.gyro_bias_rps = (bias.gyro - window.bias.gyro).norm();
  e.accel_bias_mps2 = (bias.accel - window.bias.accel).norm();
  return e;
}

Eigen::Matrix<double, 11, 1> estimationError(const Initialization& result,
                                             const SyntheticWindow& window) {
  return etalon::estimationError(
      result.states, result.bias,
      {window.truth.front().T_WB.R, window.truth.back().v_WB, window.bias});
}

}  // namespace etalon::testing
