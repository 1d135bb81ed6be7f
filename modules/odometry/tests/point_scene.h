#pragma once

// A window of the fixed-lag odometry over points that are seen exactly where they are: for tests
// that ask one part of it one question.

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "../src/fixed_lag/bridged_imu.h"
#include "../src/fixed_lag/tracks.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon::fixed_lag {

struct PointScene {
  static constexpr double kSigmaPx = 0.35;
  static constexpr TimeNs kStep = 50'000'000;

  StereoInertialCalibration calibration = eurocCalibration();
  std::vector<Eigen::Vector3d> points;  ///< p_W by id, m
  ImuNoiseDensities noise;
  Window window;

  /** Points all over the left image of a body at the origin of W, `near` to `far` m away along the
   * optical axis; the window has the state there. */
  explicit PointScene(size_t count, double near = 2.0, double far = 6.0) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(100.0, 650.0), v(80.0, 400.0), depth(near, far);
    const CameraCalibration& left = calibration.cameras[0];
    while (points.size() < count) {
      const Eigen::Vector3d ray = *left.model.unproject({u(random), v(random)});
      points.push_back(left.T_BC * (depth(random) / ray.z() * ray));
    }
    NavState start;
    start.bias.gyro = {0.01, -0.02, 0.03};
    window = windowAt(calibration, {0.0, 0.0, -9.81}, start, 0, 100.0 * Matrix15d::Identity());
  }

  /** What a body at T_WB sees of the points, of those from `first` to before `last`. */
  TrackedFrame see(const SE3& T_WB, size_t first = 0, size_t last = 100'000) const {
    TrackedFrame frame;
    frame.t = window.states.back().t;
    for (size_t id = first; id < std::min(last, points.size()); ++id) {
      std::array<std::optional<Eigen::Vector2d>, 2> pixels;
      for (size_t c = 0; c < 2; ++c) {
        const CameraCalibration& camera = calibration.cameras[c];
        pixels[c] = camera.model.project((T_WB * camera.T_BC).inverse() * points[id]);
        if (pixels[c] && !camera.model.inImage(*pixels[c])) pixels[c].reset();
      }
      if (!pixels[0]) continue;
      frame.observations.push_back({static_cast<LandmarkId>(id), *pixels[0],
                                    pixels[1].value_or(Eigen::Vector2d::Zero()),
                                    pixels[1].has_value()});
    }
    return frame;
  }
  TrackedFrame seeFromNewest() const { return see(window.states.back().now.T_WB); }

  MeasuredFrame measured(const TrackedFrame& frame) const {
    return measure(calibration, frame, kSigmaPx);
  }

  /** Appends a state that the IMU hardly holds, and puts it at T_WB. */
  void append(const SE3& T_WB) {
    const WindowState& last = window.states.back();
    appendState(bridgedImu(last.now, last.t, last.t + kStep, {}, noise, window.g_W), &window);
    NavState& now = window.states.back().now;
    now.T_WB = T_WB;
    window.states.back().linearization = now;
  }

  /** Covariance of a predicted pose that is known to a tenth of a millimetre. */
  static Eigen::Matrix<double, 6, 6> wellKnown() {
    return 1e-8 * Eigen::Matrix<double, 6, 6>::Identity();
  }
};

/** A body that has moved without turning. */
inline SE3 movedTo(double x, double y, double z) {
  return {Eigen::Matrix3d::Identity(), {x, y, z}};
}

}  // namespace etalon::fixed_lag
