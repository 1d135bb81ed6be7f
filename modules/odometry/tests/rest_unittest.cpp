// A body at rest: how it is recognised, and what is made of it.

#include "../src/fixed_lag/rest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/so3.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::Vector3d;

/** What camera and IMU of a body see that moves by `px_per_s` in the image, and shakes. */
struct RestScene {
  double px_per_s = 0.0, shake_mps2 = 0.0, turn_rps = 0.0;
  bool frozen = false;  ///< the camera repeats its image
  int tracks = 50;
};

/** At how many of 40 frames in two seconds the body is said to stand still. */
int framesAtRest(const RestScene& scene, double speed = 0.0) {
  RestDetector detector;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  int count = 0;
  std::vector<ImuSample> imu(1);
  for (int k = 0; k < 40; ++k) {
    const double t = 0.05 * k;
    TrackedFrame frame;
    frame.t = durationNs(t);
    const double seen_at = scene.frozen && k > 5 ? 0.25 : t;
    for (int l = 0; l < scene.tracks; ++l) {
      Observation o;
      o.id = l;
      o.left = {
          10.0 * l + scene.px_per_s * seen_at + (scene.frozen ? 0.0 : 0.1 * normal(generator)),
          20.0 + (scene.frozen ? 0.0 : 0.1 * normal(generator))};
      frame.observations.push_back(o);
    }
    if (k > 0) {
      imu.erase(imu.begin(), imu.end() - 1);
      for (int s = 1; s <= 10; ++s) {
        ImuSample sample;
        sample.t = durationNs(t - 0.05 + 0.005 * s);
        const double phase = 40.0 * 1e-9 * static_cast<double>(sample.t);
        sample.gyro = Vector3d(0.002 * normal(generator), scene.turn_rps * std::sin(phase), 0.01);
        sample.accel =
            Vector3d(0.03 * normal(generator), 0.1, 9.81 + scene.shake_mps2 * std::sin(phase));
        imu.push_back(sample);
      }
    }
    count += detector.atRest(frame, k > 0 ? imu : std::vector<ImuSample>(), 0.14, speed);
  }
  return count;
}

TEST(Rest, IsRecognisedAfterHalfASecond) {
  EXPECT_GE(framesAtRest({}), 28);
  EXPECT_LE(framesAtRest({}), 31);
}

TEST(Rest, IsNotWhatMoves) {
  EXPECT_EQ(framesAtRest({2.0}), 0);                 // the images creep, the IMU is calm
  EXPECT_EQ(framesAtRest({0.0, 1.0}), 0);            // it shakes
  EXPECT_EQ(framesAtRest({0.0, 0.0, 0.1}), 0);       // it turns
  EXPECT_EQ(framesAtRest({}, 0.2), 0);               // the odometry knows better
  EXPECT_EQ(framesAtRest({0, 0, 0, false, 10}), 0);  // too few tracks to tell
}

TEST(Rest, IsNotAFrozenCameraInMotion) {
  EXPECT_EQ(framesAtRest({30.0, 1.0, 0.1, true}), 0);
  EXPECT_EQ(framesAtRest({30.0, 0.0, 0.0, true}, 0.5), 0);  // steady: the speed says so
}

TEST(Rest, EndsWhenACreepingMotionHasMovedTheTracks) {
  // 0.4 px/s is 0.2 px in half a second, less than is noticed; 0.3 px are reached after 0.75 s.
  const int frames = framesAtRest({0.4});
  EXPECT_LT(frames, 15);
}

TEST(Rest, JacobiansAgreeWithDifferences) {
  Window window;
  window.states.resize(2);
  window.states[0].now.T_WB = SE3(expSO3({0.3, -0.2, 0.9}), Vector3d(1, 2, 3));
  window.states[1].now.T_WB = SE3(expSO3({0.5, -0.1, 0.7}), Vector3d(1.1, 2.2, 2.9));
  window.states[1].now.v_WB = Vector3d(0.1, 0.2, 0.3);
  RestJacobian J[2];
  restRows(window, 1, &J[0], &J[1]);
  const double h = 1e-6;
  for (size_t side = 0; side < 2; ++side)
    for (int c = 0; c < 15; ++c) {
      Window plus = window, minus = window;
      plus.states[side].now = window.states[side].now.plus(h * Vector15d::Unit(c));
      minus.states[side].now = window.states[side].now.plus(-h * Vector15d::Unit(c));
      const Eigen::Matrix<double, 9, 1> numerical =
          (restRows(plus, 1) - restRows(minus, 1)) / (2 * h);
      // Rows are divided by 1e-5: rounding of 1e-16 becomes 1e-5 in the differences.
      EXPECT_LT((J[side].col(c) - numerical).norm(), 1e-3) << side << " " << c;
    }
}

}  // namespace
}  // namespace etalon::fixed_lag
