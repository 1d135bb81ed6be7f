#include "etalon/simulation/profile_trajectory.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/core/errors.h"
#include "etalon/core/parameters.h"
#include "random.h"
#include "taylor.h"

namespace etalon {

namespace {

constexpr double kStandardGravity = 9.81;  // m/s^2, for the tilt only
constexpr int kSinusoidsPerAxis = 3;
constexpr double kHeightAtRest = 0.4;  // m above the world's origin

/** Amplitude of the rate of each sinusoid (m/s or rad/s) and the range of frequencies (Hz). */
struct AxisShape {
  double rate, min_hz, max_hz;
};

struct ProfileShape {
  AxisShape horizontal, vertical, yaw, wobble;
  double height;  // m
};

ProfileShape shapeOf(MotionProfile profile) {
  switch (profile) {
    case MotionProfile::kGentle:
      return {{0.30, 0.08, 0.30}, {0.15, 0.15, 0.40}, {0.22, 0.05, 0.20}, {0.15, 0.20, 0.60}, 1.2};
    case MotionProfile::kAggressive:
      return {{0.60, 0.15, 0.60}, {0.40, 0.25, 0.70}, {0.50, 0.10, 0.40}, {0.25, 0.30, 1.00}, 1.5};
    case MotionProfile::kPureRotation:
      return {{0.0, 0.1, 0.2}, {0.0, 0.1, 0.2}, {0.40, 0.10, 0.40}, {0.30, 0.20, 0.80}, 0.0};
    case MotionProfile::kStatic:
      break;
  }
  return {{0.0, 0.1, 0.2}, {0.0, 0.1, 0.2}, {0.0, 0.1, 0.2}, {0.0, 0.1, 0.2}, 0.0};
}

}  // namespace

MotionProfile motionProfileFromName(const std::string& name) {
  static const std::map<std::string, MotionProfile> kProfiles = {
      {"static", MotionProfile::kStatic},
      {"gentle", MotionProfile::kGentle},
      {"aggressive", MotionProfile::kAggressive},
      {"pure-rotation", MotionProfile::kPureRotation}};
  const auto found = kProfiles.find(name);
  if (found == kProfiles.end()) {
    throw ConfigError("motion profile '" + name +
                      "' is unknown; expected static, gentle, aggressive or pure-rotation");
  }
  return found->second;
}

ProfileTrajectory::ProfileTrajectory(const ProfileOptions& options) : options_(options) {
  const auto usable = [](double s) { return std::isfinite(s) && s >= 0.0 && s < 1e6; };
  if (!usable(options.duration_s) || !usable(options.rest_s) || !usable(options.take_off_s) ||
      options.take_off_s == 0.0) {
    throw ConfigError(
        "a simulated flight needs a duration and a rest of at least 0 s and a take-off of more "
        "than 0 s");
  }
  start_ = options.start;
  end_ = start_ + durationNs(options.duration_s);
  const ProfileShape shape = shapeOf(options.profile);
  const std::array<AxisShape, 6> shapes = {shape.horizontal, shape.horizontal, shape.vertical,
                                           shape.yaw,        shape.wobble,     shape.wobble};
  height_ = shape.height;
  tilt_ = shape.horizontal.rate > 0.0 ? 1.0 : 0.0;
  Random random(options.seed, kMotionStream);
  heading_ = random.uniform(-M_PI, M_PI);
  for (size_t axis = 0; axis < shapes.size(); ++axis) {
    const AxisShape& s = shapes[axis];
    for (int i = 0; i < kSinusoidsPerAxis; ++i) {
      // One frequency in each third of the range (in octaves), so that slow and fast motion are
      // both there.
      const double share = (i + random.uniform()) / kSinusoidsPerAxis;
      const double omega = 2.0 * M_PI * s.min_hz * std::pow(s.max_hz / s.min_hz, share);
      const double phase = random.uniform(-M_PI, M_PI);
      if (s.rate > 0.0) axes_[axis].push_back({s.rate / omega, omega, phase});
    }
  }
}

TrajectoryState ProfileTrajectory::at(TimeNs t) const {
  const TimeNs inside = std::clamp(t, start_, end_);
  const double s = secondsBetween(start_, inside);
  // Third order: the tilt takes the second derivative of the position, the angular rate takes that
  // of the tilt.
  using Series = Taylor<3>;
  const Series window = smoothStep<3>(options_.rest_s, options_.take_off_s, s);
  std::array<Series, 6> q;
  for (size_t axis = 0; axis < axes_.size(); ++axis) {
    if (axis == 2) q[axis] = Series::constant(height_);
    for (const Sinusoid& w : axes_[axis]) {
      q[axis] = q[axis] + sinusoid<3>(w.amplitude, w.angular_frequency, w.phase, s);
    }
    q[axis] = q[axis] * window;
  }
  TrajectoryState state;
  state.t = t;
  for (int i = 0; i < 3; ++i) {
    const Series& p = q[i];
    state.T_WB.t[i] = p.c[0];
    state.v_WB[i] = p.c[1];
    state.a_W[i] = 2.0 * p.c[2];
  }
  state.T_WB.t.z() += kHeightAtRest;

  // Acceleration along the heading and to its left, as first-order series.
  const double yaw = heading_ + q[3].c[0], yaw_rate = q[3].c[1];
  const Taylor<1> cos_yaw{{std::cos(yaw), -std::sin(yaw) * yaw_rate}};
  const Taylor<1> sin_yaw{{std::sin(yaw), std::cos(yaw) * yaw_rate}};
  const Taylor<1> ax{{2.0 * q[0].c[2], 6.0 * q[0].c[3]}};
  const Taylor<1> ay{{2.0 * q[1].c[2], 6.0 * q[1].c[3]}};
  const Taylor<1> forward = ax * cos_yaw + ay * sin_yaw;
  const Taylor<1> left = ay * cos_yaw + ax * sin_yaw * -1.0;
  const double gain = tilt_ / kStandardGravity;
  const double pitch = q[4].c[0] + gain * forward.value();
  const double pitch_rate = q[4].c[1] + gain * forward.rate();
  const double roll = q[5].c[0] - gain * left.value();
  const double roll_rate = q[5].c[1] - gain * left.rate();

  // R_WH = Rz(yaw) Ry(pitch) Rx(roll), H: x forward, y left, z up.
  const double cp = std::cos(pitch), sp = std::sin(pitch), cr = std::cos(roll), sr = std::sin(roll);
  const double cy = cos_yaw.value(), sy = sin_yaw.value();
  Eigen::Matrix3d R_WH;
  R_WH << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,      //
      -sp, cp * sr, cp * cr;
  const Eigen::Vector3d omega_H(roll_rate - yaw_rate * sp, pitch_rate * cr + yaw_rate * cp * sr,
                                -pitch_rate * sr + yaw_rate * cp * cr);
  Eigen::Matrix3d R_HB;  // EuRoC's body: x up, y right, z forward
  R_HB << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  state.T_WB.R = R_WH * R_HB;
  state.omega_B = R_HB.transpose() * omega_H;
  return state;
}

}  // namespace etalon
