#include "etalon/initialization/steps/inertial_only_map.h"

#include <gtest/gtest.h>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/translation_ba.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindowOptions;

struct MapCase {
  explicit MapCase(const SyntheticWindowOptions& options)
      : window(testing::makeSyntheticWindow(options)) {
    T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& s : window.truth) T_VB.push_back(T_VW * s.T_WB);
    g_V = T_VW.R * Vector3d(0, 0, -options.gravity_mps2);
  }
  std::vector<Preintegration> preintegrate(const ImuBias& bias) const {
    std::vector<Preintegration> result;
    for (size_t k = 1; k < window.truth.size(); ++k)
      result.emplace_back(window.imu.between(window.truth[k - 1].t, window.truth[k].t), bias,
                          window.calibration.imu.noise);
    return result;
  }
  testing::SyntheticWindow window;
  SE3 T_VW;
  std::vector<SE3> T_VB;
  Vector3d g_V;
};

TEST(InertialOnlyMap, IsExactOnExactPosesWithoutPriors) {
  for (const testing::Motion motion : {testing::Motion::kGentle, testing::Motion::kAggressive,
                                       testing::Motion::kCircle, testing::Motion::kPureRotation}) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
    const MapCase c(options);
    InertialOnlyOptions map;
    map.prior_gyro_information = map.prior_accel_information = 0.0;
    ImuBias bias;
    InertialOnlyResult result;
    for (int pass = 0; pass < 5; ++pass) {  // the first-order bias correction needs re-integration
      result = solveInertialOnlyMap(c.T_VB, c.preintegrate(bias), map);
      ASSERT_TRUE(result.summary.converged());
      bias = result.bias;
    }
    // Noise-free: what remains is rounding, amplified by the condition of gravity against b_a.
    EXPECT_LT((result.bias.gyro - options.bias.gyro).norm(), 1e-8);
    EXPECT_LT((result.bias.accel - options.bias.accel).norm(), 1e-6);
    EXPECT_LT(angleBetween(result.g_V, c.g_V), 1e-7);
    for (size_t k = 0; k < c.T_VB.size(); ++k)
      EXPECT_LT((result.v_VB[k] - c.T_VW.R * c.window.truth[k].v_WB).norm(), 1e-6);
  }
}

TEST(InertialOnlyMap, CannotTellTiltFromAccelerometerBiasAtRest) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kStandstill;
  const MapCase c(options);
  InertialOnlyOptions map;
  map.prior_accel_information = 1.0 / (0.1 * 0.1);
  const InertialOnlyResult result = solveInertialOnlyMap(c.T_VB, c.preintegrate({}), map);
  ASSERT_TRUE(result.summary.converged());
  ASSERT_EQ(result.covariance.rows(), 8);
  // b_a known to 0.1 m/s^2 leaves the tilt at 0.1 / 9.81 rad.
  EXPECT_NEAR(1.0 / std::sqrt(result.smallest_eigenvalue_gravity), 0.1 / 9.81, 1e-4);
}

TEST(InertialOnlyMap, PriorPullsTheAccelerometerBias) {
  SyntheticWindowOptions options;
  options.bias.accel = {0.1, 0.1, 0.1};
  const MapCase c(options);
  InertialOnlyOptions map;
  map.prior_accel_information = 1e12;
  const InertialOnlyResult result = solveInertialOnlyMap(c.T_VB, c.preintegrate({}), map);
  EXPECT_LT(result.bias.accel.norm(), 1e-3);
  EXPECT_GT(angleBetween(result.g_V, c.g_V), 1e-3);  // and gravity pays for it
}

class TranslationBa : public ::testing::TestWithParam<bool> {};

TEST_P(TranslationBa, RecoversTranslationsUnderTrueRotations) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const MapCase c(options);
  const VisualWindow window = buildVisualWindow(c.window.calibration, c.window.keyframes(), 1.0);
  std::map<LandmarkId, Vector3d> landmarks;
  for (const LandmarkId id : window.landmark_ids) {
    Vector3d& p = landmarks[id] = c.T_VW * c.window.landmarks[id];
    if (GetParam()) p *= 1.01;  // free landmarks may start wrong
  }
  std::vector<SE3> start = c.T_VB;
  for (size_t k = 1; k < start.size(); ++k) start[k].t += Vector3d(0.05, -0.04, 0.03);
  TranslationBaOptions ba;
  ba.landmarks_free = GetParam();
  ba.chi2_threshold = 1e4;  // the start is 15 px off; nothing is an outlier here
  const TranslationBaResult result =
      solveTranslationBa(BundleProblem(window, landmarks), start, ba);
  ASSERT_TRUE(result.summary.converged());
  EXPECT_LT(result.summary.final_cost, 1e-6 * result.summary.initial_cost);
  for (size_t k = 0; k < start.size(); ++k) {
    EXPECT_EQ(result.T_VB[k].R, c.T_VB[k].R);
    EXPECT_LT((result.T_VB[k].t - c.T_VB[k].t).norm(), 1e-6);  // stops at steps of 1e-7 m
  }
}

INSTANTIATE_TEST_SUITE_P(LandmarksFree, TranslationBa, ::testing::Bool());

}  // namespace
}  // namespace etalon
