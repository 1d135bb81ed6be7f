#include "etalon/simulation/synthetic_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"

namespace etalon::testing {
namespace {

using Eigen::Vector3d;

/** The observations of all frames against the projection of the true landmarks. */
struct PixelErrors {
  double sum2 = 0.0, largest = 0.0;
  int count = 0, above_5 = 0;
};

PixelErrors pixelErrors(const SyntheticWindow& window) {
  PixelErrors errors;
  for (size_t k = 0; k < window.keyframe_indices.size(); ++k) {
    const SE3& T_WB = window.truth[k].T_WB;
    for (const Observation& o : window.keyframes()[k]->observations) {
      const Vector3d p_B = T_WB.inverse() * window.landmarks[o.id];
      for (size_t c = 0; c < (o.has_right ? 2U : 1U); ++c) {
        const CameraCalibration& camera = window.calibration.cameras[c];
        const auto pixel = camera.model.project(camera.T_BC.inverse() * p_B);
        if (!pixel) continue;
        const double error = (*pixel - (c == 0 ? o.left : o.right)).norm();
        errors.sum2 += error * error;
        errors.largest = std::max(errors.largest, error);
        errors.above_5 += error > 5.0;
        ++errors.count;
      }
    }
  }
  return errors;
}

TEST(SyntheticWindow, WithoutNoiseEverythingAgreesToRounding) {
  for (const Motion motion : kAllMotions) {
    SCOPED_TRACE(toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    const SyntheticWindow window = makeSyntheticWindow(options);
    ASSERT_EQ(window.truth.size(), 10U);
    ASSERT_EQ(window.frames.size(), 9U * 5U + 1U);
    const PixelErrors errors = pixelErrors(window);
    EXPECT_GT(errors.count, 10 * 100);
    EXPECT_LT(errors.largest, 1e-8);
    for (size_t k = 1; k < window.truth.size(); ++k) {
      const StampedState &from = window.truth[k - 1], &to = window.truth[k];
      const Preintegration p(window.imu.between(from.t, to.t), options.bias,
                             window.calibration.imu.noise);
      const double dt = secondsBetween(from.t, to.t);
      const Vector3d g(0, 0, -options.gravity_mps2);
      EXPECT_LT((from.T_WB.R * p.deltas().dR - to.T_WB.R).norm(), 1e-10);
      EXPECT_LT((from.v_WB + g * dt + from.T_WB.R * p.deltas().dv - to.v_WB).norm(), 1e-10);
      EXPECT_LT((from.T_WB.t + from.v_WB * dt + 0.5 * g * dt * dt + from.T_WB.R * p.deltas().dp -
                 to.T_WB.t)
                    .norm(),
                1e-10);
    }
  }
}

TEST(SyntheticWindow, MotionsAreWhatTheirNamesSay) {
  const auto windowOf = [](Motion motion) {
    SyntheticWindowOptions options;
    options.motion = motion;
    return makeSyntheticWindow(options);
  };
  const auto path = [](const SyntheticWindow& w) {
    double length = 0.0;
    for (size_t k = 1; k < w.truth.size(); ++k)
      length += (w.truth[k].T_WB.t - w.truth[k - 1].T_WB.t).norm();
    return length;
  };
  const auto turn = [](const SyntheticWindow& w) {
    double angle = 0.0;
    for (size_t k = 1; k < w.truth.size(); ++k)
      angle += logSO3(w.truth[k - 1].T_WB.R.transpose() * w.truth[k].T_WB.R).norm();
    return angle;
  };
  const SyntheticWindow still = windowOf(Motion::kStandstill);
  EXPECT_LT(path(still), 1e-9);
  EXPECT_LT(turn(still), 1e-9);
  const SyntheticWindow turning = windowOf(Motion::kPureRotation);
  EXPECT_LT(path(turning), 1e-3);
  EXPECT_GT(turn(turning), 0.2);
  const SyntheticWindow even = windowOf(Motion::kConstantVelocity);
  EXPECT_GT(path(even), 0.2);
  for (const StampedState& s : even.truth) EXPECT_LT((s.v_WB - even.truth[0].v_WB).norm(), 1e-6);
  EXPECT_GT(path(windowOf(Motion::kAggressive)), path(windowOf(Motion::kGentle)));
  EXPECT_GT(turn(windowOf(Motion::kAggressive)), turn(windowOf(Motion::kGentle)));
}

TEST(SyntheticWindow, PixelNoiseAndOutliersAreAsMuchAsAskedFor) {
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  const PixelErrors noisy = pixelErrors(makeSyntheticWindow(options));
  // Two coordinates a pixel; some thousand of them: within five standard deviations.
  const double variance = noisy.sum2 / (2.0 * noisy.count);
  EXPECT_NEAR(variance, 0.25, 5.0 * 0.25 / std::sqrt(noisy.count));
  EXPECT_LT(noisy.largest, 0.5 * 6.0);
  options.sigma_px = 0.0;
  options.outlier_share = 0.2;
  const PixelErrors outliers = pixelErrors(makeSyntheticWindow(options));
  EXPECT_GT(outliers.above_5, 0.05 * outliers.count);
  EXPECT_LT(outliers.above_5, 0.30 * outliers.count);
  EXPECT_LE(outliers.largest, 50.0 * std::sqrt(2.0));
}

TEST(SyntheticWindow, TheSeedDecidesOnEverything) {
  SyntheticWindowOptions options;
  options.sigma_px = 0.5;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  const SyntheticWindow a = makeSyntheticWindow(options), b = makeSyntheticWindow(options);
  ++options.seed;
  const SyntheticWindow c = makeSyntheticWindow(options);
  EXPECT_EQ(a.frames[3].observations[5].left, b.frames[3].observations[5].left);
  EXPECT_EQ(a.imu.samples()[7].gyro, b.imu.samples()[7].gyro);
  EXPECT_EQ(a.truth.back().T_WB.t, b.truth.back().T_WB.t);
  EXPECT_NE(a.imu.samples()[7].gyro, c.imu.samples()[7].gyro);
}

}  // namespace
}  // namespace etalon::testing
