#include "../benchmarks/prediction_error.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

constexpr double kSigmaPx = 0.3;

struct Example {
  VisualWindow window;
  std::vector<SE3> T_WB;  ///< true
};

Example example() {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.sigma_px = kSigmaPx;
  const testing::SyntheticWindow flight = testing::makeSyntheticWindow(options);
  Example result;
  result.window = buildVisualWindow(flight.calibration, flight.keyframes(), kSigmaPx);
  for (const StampedState& state : flight.truth) result.T_WB.push_back(state.T_WB);
  return result;
}

/** RMS of a coordinate's error over the pixels of keyframe `k` (-1: of all) that are predicted. */
double rms(const Example& example, const std::vector<double>& errors, int k = -1) {
  double sum = 0.0, n = 0.0;
  for (size_t i = 0; i < errors.size(); ++i) {
    if (std::isnan(errors[i]) || (k >= 0 && example.window.measurements[i].keyframe != k)) continue;
    sum += errors[i] * errors[i];
    n += 2.0;
  }
  return std::sqrt(sum / n);
}

TEST(PredictionErrors, AreThePixelsNoiseAndTheLandmarksAtTheTruth) {
  const Example flight = example();
  const std::vector<double> errors = predictionErrors(flight.window, kSigmaPx, flight.T_WB);
  // A pixel's own noise and a smaller part of the landmark's: its 3 unknowns come from 8 or more
  // coordinates in two other keyframes (sqrt(1 + 3/8) = 1.17), mostly from many more. In-sample
  // residuals would be below kSigmaPx.
  EXPECT_GT(rms(flight, errors), 1.01 * kSigmaPx);
  EXPECT_LT(rms(flight, errors), 1.17 * kSigmaPx);
}

TEST(PredictionErrors, SeeATurnedKeyframe) {
  const Example flight = example();
  constexpr int kTurned = 4;
  constexpr double kTurn = 2e-3;  // rad about the camera's axes in the image: 0.9 px
  std::vector<SE3> wrong = flight.T_WB;
  const Eigen::Vector3d axis = flight.window.T_CB[0].inverse().R * Eigen::Vector3d::UnitY();
  wrong[kTurned].R = wrong[kTurned].R * expSO3(kTurn * axis);
  const std::vector<double> errors = predictionErrors(flight.window, kSigmaPx, wrong);
  const double before = rms(flight, predictionErrors(flight.window, kSigmaPx, flight.T_WB));
  // f = 458 px; half of a turn about y is in u, none in v. A pixel off the middle of the distorted
  // image moves by up to a fifth more or less.
  EXPECT_NEAR(rms(flight, errors, kTurned), std::hypot(before, 458.0 * kTurn / std::sqrt(2.0)),
              0.1);
  EXPECT_GT(rms(flight, errors), 1.1 * before);
}

TEST(PredictionErrors, DoNotChangeWithTheWorld) {
  const Example flight = example();
  const SE3 T_AW{expSO3(Eigen::Vector3d(0.3, -0.2, 2.0)), Eigen::Vector3d(5.0, -3.0, 1.0)};
  std::vector<SE3> moved;
  for (const SE3& T : flight.T_WB) moved.push_back(T_AW * T);
  const std::vector<double> a = predictionErrors(flight.window, kSigmaPx, flight.T_WB);
  const std::vector<double> b = predictionErrors(flight.window, kSigmaPx, moved);
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::isnan(a[i]), std::isnan(b[i]));
    if (!std::isnan(a[i])) {
      ASSERT_NEAR(a[i], b[i], 1e-6);
    }
  }
}

TEST(PredictionErrors, APixelDoesNotPredictItself) {
  Example flight = example();
  const std::vector<double> before = predictionErrors(flight.window, kSigmaPx, flight.T_WB);
  size_t checked = 0;
  for (size_t i = 0; i < before.size(); i += 97) {
    const Example untouched = flight;
    VisualMeasurement& m = flight.window.measurements[i];
    const Eigen::Vector2d shift(10.0 / kSigmaPx, 0.0);  // whitened: 10 px
    m.measurement.xy += m.measurement.sqrt_information.inverse() * shift;
    const double after = predictionErrors(flight.window, kSigmaPx, flight.T_WB)[i];
    if (!std::isnan(before[i])) {
      // The error is all of the ten pixels, because the prediction does not move along.
      EXPECT_NEAR(after, 10.0, before[i] + 1e-9);
      ++checked;
    }
    flight = untouched;
  }
  EXPECT_GT(checked, 10u);
}

TEST(PredictionErrors, NeedTwoOtherKeyframes) {
  Example flight = example();
  VisualWindow& window = flight.window;
  const int first_keyframe = window.measurements[0].keyframe;
  std::vector<VisualMeasurement> kept;
  for (const VisualMeasurement& m : window.measurements)
    if (m.landmark == 0 && m.keyframe <= first_keyframe + 1) kept.push_back(m);
  window.measurements = kept;
  window.landmark_ids.resize(1);
  window.first = {0, static_cast<int>(kept.size())};
  ASSERT_GE(kept.size(), 2u);
  for (const double error : predictionErrors(window, kSigmaPx, flight.T_WB))
    EXPECT_TRUE(std::isnan(error));
}

}  // namespace
}  // namespace etalon
