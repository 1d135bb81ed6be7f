// What takes the place of an IMU that is missing.

#include "../src/fixed_lag/bridged_imu.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr TimeNs kMs = 1'000'000;
const Vector3d kGravity(0.0, 0.0, -9.81);

std::vector<ImuSample> samplesAt(const std::vector<TimeNs>& milliseconds) {
  std::vector<ImuSample> samples;
  for (const TimeNs t : milliseconds) samples.push_back({t * kMs, {0.1, 0.2, 0.3}, {1.0, 2.0, 9}});
  return samples;
}

NavState flying() {
  NavState state;
  state.T_WB = {expSO3({0.4, -0.3, 1.2}), {1.0, 2.0, 3.0}};
  state.v_WB = {1.0, -2.0, 0.5};
  state.bias = {{0.01, -0.02, 0.03}, {0.1, -0.2, 0.3}};
  return state;
}

TEST(IsComplete, ReachesFromEndToEndWithoutAGapOfMoreThan30Ms) {
  constexpr double kRate = 200.0;
  EXPECT_TRUE(isComplete(samplesAt({0, 29, 58, 60}), 0, 60 * kMs, kRate));
  EXPECT_FALSE(isComplete(samplesAt({0, 29, 60}), 0, 60 * kMs, kRate));   // 31 ms
  EXPECT_FALSE(isComplete(samplesAt({0, 29}), 0, 60 * kMs, kRate));       // ends early
  EXPECT_FALSE(isComplete(samplesAt({29, 58, 60}), 0, 60 * kMs, kRate));  // begins late
  EXPECT_FALSE(isComplete(samplesAt({0}), 0, 0, kRate));
  EXPECT_FALSE(isComplete({}, 0, 0, kRate));
}

TEST(IsComplete, OneMissingSampleOfASlowImuIsNoGap) {
  EXPECT_TRUE(isComplete(samplesAt({0, 40, 120, 160}), 0, 160 * kMs, 25.0));
  EXPECT_FALSE(isComplete(samplesAt({0, 40, 160}), 0, 160 * kMs, 25.0));
}

TEST(BridgedImu, WithoutSamplesTheBodyKeepsVelocityAndAttitude) {
  const NavState from = flying();
  for (const auto& what : {samplesAt({}), samplesAt({100}), samplesAt({100, 300})}) {
    const Preintegration bridge = bridgedImu(from, 100 * kMs, 600 * kMs, what, {}, kGravity);
    EXPECT_EQ(bridge.end(), 600 * kMs);
    EXPECT_DOUBLE_EQ(bridge.dt(), 0.5);
    const NavState to = bridge.predict(from, kGravity);
    EXPECT_LT(logSO3(to.T_WB.R.transpose() * from.T_WB.R).norm(), 1e-12);
    EXPECT_LT((to.v_WB - from.v_WB).norm(), 1e-12);
    EXPECT_LT((to.T_WB.t - from.T_WB.t - 0.5 * from.v_WB).norm(), 1e-12);
  }
}

TEST(BridgedImu, IsAsUncertainAsAFlightIsUnruly) {
  // Rates of 0.5 rad/s that stay the same for the gap turn by 0.5 T; the density of such a walk is
  // 0.5 sqrt(T), and the angle's variance that squared times T.
  for (const double gap : {0.1, 0.5, 2.0}) {
    const Preintegration bridge = bridgedImu(flying(), 0, durationNs(gap), {}, {}, kGravity);
    const Vector3d angle = bridge.covariance().diagonal().head<3>().cwiseSqrt();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(angle[i], 0.5 * gap, 0.01 * gap) << gap;
    // Likewise 2 m/s^2 are 2 T of velocity; the turning adds to that what gravity does with it.
    const Vector3d velocity = bridge.covariance().diagonal().segment<3>(6).cwiseSqrt();
    EXPECT_GT(velocity.minCoeff(), 1.99 * gap);
    EXPECT_LT(velocity.maxCoeff(), 2.0 * gap + 9.81 * 0.5 * gap * gap);
  }
}

TEST(BridgedImu, SamplesWithAGapAreKeptAndTheirGapMakesThemUncertain) {
  const NavState from = flying();
  const auto samples = samplesAt({0, 5, 10, 110, 115});
  const Preintegration bridge = bridgedImu(from, 0, 115 * kMs, samples, {}, kGravity);
  const Preintegration plain(samples, from.bias, {});
  EXPECT_EQ(bridge.deltas().dR, plain.deltas().dR);
  EXPECT_EQ(bridge.deltas().dv, plain.deltas().dv);
  // Density 0.5 sqrt(0.1 s), over all of the 0.115 s.
  const double sigma = std::sqrt(bridge.covariance()(0, 0));
  EXPECT_NEAR(sigma, 0.5 * std::sqrt(0.1 * 0.115), 0.01 * sigma);
  EXPECT_LT(plain.covariance()(0, 0), 1e-3 * bridge.covariance()(0, 0));
}

}  // namespace
}  // namespace etalon
