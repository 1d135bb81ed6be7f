#include "etalon/evaluation/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kRadians = M_PI / 180.0;

GroundTruth truthOf(const std::vector<StampedState>& states, const ImuBias& bias) {
  GroundTruth truth;
  truth.has_velocity = truth.has_biases = true;
  for (const StampedState& s : states) truth.states.push_back({s.t, s.T_WB, s.v_WB, bias});
  return truth;
}

/** Four keyframes, 0.25 s apart, on the corners of a square of 1 m, level, at rest. */
std::vector<StampedState> square() {
  std::vector<StampedState> states(4);
  const Vector3d corners[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  for (int k = 0; k < 4; ++k) {
    states[k].t = 250'000'000LL * k;
    states[k].T_WB.t = corners[k];
  }
  return states;
}

const ImuBias kTrueBias{Vector3d(0.01, 0.02, 0.03), Vector3d(0.1, 0.2, 0.3)};

TEST(WindowMetrics, PerfectEstimateHasNoErrorWhateverItsYawAndOrigin) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  const SE3 T_WG(expSO3(Vector3d(0, 0, 2.0)), Vector3d(3, -4, 5));
  for (StampedState& s : states) s.T_WB = T_WG * s.T_WB;
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
  EXPECT_EQ(e.keyframes, 4);
  // Rounding: positions of size 5 and rotations, a few units in the last place.
  EXPECT_LT(e.rre_deg, 1e-12);
  EXPECT_LT(e.ate_m, 1e-14);
  EXPECT_LT(e.gravity_deg, 1e-13);
  EXPECT_EQ(e.velocity_mps, 0.0);
  EXPECT_EQ(e.gyro_bias_rps, 0.0);
  EXPECT_EQ(e.accel_bias_mps2, 0.0);
  EXPECT_LT(e.scale_error, 1e-14);
  EXPECT_EQ(e.success(), true);
}

TEST(WindowMetrics, OutsideItsClaimIsWhatIsBeyondThreeAndAHalfSigmas) {
  WindowErrors e;
  EXPECT_THAT(e.outsideClaim(), IsEmpty());  // nothing is claimed
  // Chi-square at 4.65e-4: 15.35 for two degrees of freedom, 17.89 for three.
  e.tilt_nees = 15.3 / 2;
  e.velocity_nees = e.accel_bias_nees = 17.8 / 3;
  e.gyro_bias_nees = 100.0;  // the ground truth's does not count
  EXPECT_THAT(e.outsideClaim(), IsEmpty());
  for (const auto& [name, nees] :
       {std::pair("tilt", &WindowErrors::tilt_nees),
        std::pair("velocity", &WindowErrors::velocity_nees),
        std::pair("accelerometer bias", &WindowErrors::accel_bias_nees)}) {
    WindowErrors outside = e;
    outside.*nees *= 1.01;
    EXPECT_THAT(outside.outsideClaim(), ElementsAre(name));
  }
}

TEST(WindowMetrics, RelativeRotationByHand) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  // Pairs (0,1) and (1,2): 3 and 4 degrees about different axes; (2,3): none. RMS = sqrt((9 + 16) /
  // 3).
  states[1].T_WB.R = expSO3(Vector3d(3 * kRadians, 0, 0));
  states[2].T_WB.R = states[1].T_WB.R * expSO3(Vector3d(0, 4 * kRadians, 0));
  states[3].T_WB.R = states[2].T_WB.R;
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
  EXPECT_NEAR(e.rre_deg, std::sqrt(25.0 / 3.0), 1e-12);
  EXPECT_EQ(e.gravity_deg, 0.0);  // the first keyframe's rotation was left alone
}

TEST(WindowMetrics, PositionAndScaleByHand) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  // A square of 1.1 m: after SE(3) alignment each corner is 0.1 / sqrt(2) off; s = 1 / 1.1.
  for (StampedState& s : states) s.T_WB.t *= 1.1;
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
  EXPECT_NEAR(e.ate_m, 0.1 / std::sqrt(2.0), 1e-14);
  EXPECT_NEAR(e.scale_error, 1.0 - 1.0 / 1.1, 1e-14);
}

TEST(WindowMetrics, ScaleNeedsAPathOfFiveCentimetres) {
  for (const double side_m : {0.0166, 0.0167}) {  // three sides: 4.98 cm, 5.01 cm
    std::vector<StampedState> states = square();
    for (StampedState& s : states) s.T_WB.t *= side_m;
    const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(states, kTrueBias));
    EXPECT_EQ(std::isnan(e.scale_error), side_m < 0.01667) << side_m;
    EXPECT_LT(e.ate_m, 1e-15);
  }
  // An estimate that did not move at all has no scale to compare.
  std::vector<StampedState> still = square();
  for (StampedState& s : still) s.T_WB.t.setZero();
  EXPECT_TRUE(
      std::isnan(evaluateWindow(still, kTrueBias, truthOf(square(), kTrueBias)).scale_error));
}

TEST(WindowMetrics, GravityIsComparedInTheBodyOfTheFirstKeyframe) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  // The estimate's world leans by 3 degrees: every rotation is off, no relative one is.
  const Matrix3d lean = expSO3(Vector3d(3 * kRadians, 0, 0)) * expSO3(Vector3d(0, 0, 1.0));
  for (StampedState& s : states) s.T_WB = SE3(lean, Vector3d::Zero()) * s.T_WB;
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
  EXPECT_NEAR(e.gravity_deg, 3.0, 1e-12);
  EXPECT_LT(e.rre_deg, 1e-12);
  EXPECT_EQ(e.success(), false);
}

TEST(WindowMetrics, CorrectedGravityIsComparedWithTheDirectionThatIsGiven) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  const Matrix3d lean = expSO3(Vector3d(3 * kRadians, 0, 0));
  for (StampedState& s : states) s.T_WB = SE3(lean, Vector3d::Zero()) * s.T_WB;
  // The estimate's gravity in the ground truth's world is lean^T (0, 0, -1).
  const Vector3d g_G = expSO3(Vector3d(-1 * kRadians, 0, 0)) * Vector3d(0, 0, -1);
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias), g_G);
  EXPECT_NEAR(e.gravity_deg, 3.0, 1e-12);  // stays raw
  EXPECT_NEAR(e.gravity_corrected_deg, 2.0, 1e-12);
  EXPECT_EQ(e.success(), false);
  const Vector3d same = lean.transpose() * Vector3d(0, 0, -1);
  EXPECT_LT(
      evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias), same).gravity_corrected_deg,
      1e-12);
  EXPECT_TRUE(std::isnan(
      evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias)).gravity_corrected_deg));
}

TEST(WindowMetrics, AlignmentInYawKeepsATilt) {
  const std::vector<StampedState> truth = square();
  // Corners (+-1/2, +-1/2, 0) leant by the angle a about x: y becomes cos(a) y, z becomes sin(a) y;
  // off by 1/2 sqrt((1 - cos a)^2 + sin^2 a) = sin(a / 2) each, whatever the yaw.
  for (const double yaw : {0.0, 2.0}) {
    std::vector<StampedState> states = truth;
    const SE3 T_WG(expSO3(Vector3d(0, 0, yaw)) * expSO3(Vector3d(0.1, 0, 0)), Vector3d(1, 2, 3));
    for (StampedState& s : states) s.T_WB = T_WG * s.T_WB;
    const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
    EXPECT_NEAR(e.ate_yaw_m, std::sin(0.05), 1e-14);
    EXPECT_LT(e.ate_m, 1e-14);
  }
}

TEST(WindowMetrics, VelocityIsComparedAsAVectorInTheBody) {
  const std::vector<StampedState> truth = square();
  std::vector<StampedState> states = truth;
  states[0].v_WB = Vector3d(0.03, 0, 0);
  states[1].v_WB = Vector3d(0, 0.03, 0.04);
  const WindowErrors e = evaluateWindow(states, kTrueBias, truthOf(truth, kTrueBias));
  EXPECT_NEAR(e.velocity_mps, std::sqrt((9e-4 + 25e-4) / 4), 1e-15);
  EXPECT_EQ(e.success(), true);

  // Same speed and the world turned by 90 degrees about z: no error in the body frame.
  std::vector<StampedState> moving = truth, turned = truth;
  const Matrix3d R = expSO3(Vector3d(0, 0, M_PI / 2));
  for (size_t k = 0; k < 4; ++k) {
    moving[k].v_WB = Vector3d(1, 2, 3);
    turned[k].v_WB = R * moving[k].v_WB;
    turned[k].T_WB = SE3(R, Vector3d::Zero()) * turned[k].T_WB;
  }
  EXPECT_LT(evaluateWindow(turned, kTrueBias, truthOf(moving, kTrueBias)).velocity_mps, 1e-14);
  // Turned velocities with unturned rotations: an error of sqrt(2) times the horizontal speed.
  for (size_t k = 0; k < 4; ++k) turned[k].T_WB = truth[k].T_WB;
  EXPECT_NEAR(evaluateWindow(turned, kTrueBias, truthOf(moving, kTrueBias)).velocity_mps,
              std::sqrt(2.0 * 5.0), 1e-13);
}

TEST(WindowMetrics, BiasesAreComparedAsVectorsWithTheMeanTruth) {
  const std::vector<StampedState> states = square();
  GroundTruth truth = truthOf(states, kTrueBias);
  truth.states[0].bias.gyro.x() += 0.004;  // mean over four keyframes: 0.001
  truth.states[3].bias.accel.z() += 0.04;  // 0.01
  ImuBias estimate = kTrueBias;
  estimate.gyro += Vector3d(0.001 + 0.003, 0, 0.004);
  estimate.accel -= Vector3d(0.03, 0.04, -0.01);
  const WindowErrors e = evaluateWindow(states, estimate, truth);
  EXPECT_NEAR(e.gyro_bias_rps, 0.005, 1e-16);
  EXPECT_NEAR(e.accel_bias_mps2, 0.05, 1e-16);
}

TEST(WindowMetrics, WhatTheGroundTruthDoesNotAllowIsNaN) {
  const std::vector<StampedState> states = square();
  GroundTruth poses_only = truthOf(states, {});
  poses_only.has_velocity = poses_only.has_biases = false;
  const WindowErrors e = evaluateWindow(states, kTrueBias, poses_only);
  EXPECT_EQ(e.ate_m, 0.0);
  EXPECT_EQ(e.gravity_deg, 0.0);
  EXPECT_TRUE(std::isnan(e.velocity_mps));
  EXPECT_TRUE(std::isnan(e.gyro_bias_rps));
  EXPECT_TRUE(std::isnan(e.accel_bias_mps2));
  EXPECT_FALSE(e.success().has_value());

  const WindowErrors none = evaluateWindow(states, kTrueBias, {});
  EXPECT_EQ(none.keyframes, 0);
  for (const double value : {none.rre_deg, none.ate_m, none.gravity_deg, none.scale_error})
    EXPECT_TRUE(std::isnan(value));
}

TEST(WindowMetrics, KeyframesWithoutGroundTruthAreLeftOut) {
  std::vector<StampedState> states = square();
  GroundTruth truth = truthOf(states, kTrueBias);
  truth.states.erase(truth.states.begin());
  states[0].T_WB.t = Vector3d(100, 100, 100);
  states[0].T_WB.R = expSO3(Vector3d(1, 1, 1));
  const WindowErrors e = evaluateWindow(states, kTrueBias, truth);
  EXPECT_EQ(e.keyframes, 3);
  EXPECT_LT(e.ate_m, 1e-15);
  EXPECT_EQ(e.rre_deg, 0.0);
  EXPECT_TRUE(std::isnan(e.gravity_deg));  // it is defined at the first keyframe
}

TEST(Statistics, ByHand) {
  const ErrorStatistics s = statisticsOf({4.0, 1.0, 2.0, 3.0});
  EXPECT_EQ(s.count, 4u);
  EXPECT_EQ(s.mean, 2.5);
  EXPECT_EQ(s.median, 2.5);
  EXPECT_EQ(s.max, 4.0);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(30.0 / 4.0));
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.sse, 30.0);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt((2.25 + 2.25 + 0.25 + 0.25) / 4.0));
  EXPECT_EQ(statisticsOf({5.0, 1.0, 3.0}).median, 3.0);
  EXPECT_TRUE(std::isnan(statisticsOf({}).rmse));
}

TEST(Statistics, OfNaNThereIsNoMedian) {
  EXPECT_TRUE(std::isnan(statisticsOf({1.0, std::numeric_limits<double>::quiet_NaN()}).median));
}

}  // namespace
}  // namespace etalon
