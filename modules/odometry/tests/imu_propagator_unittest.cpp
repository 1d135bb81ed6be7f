#include "etalon/odometry/imu_propagator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr TimeNs kPeriod = 5'000'000;  // 200 Hz
constexpr double kGravityNorm = 9.81;
constexpr double kMaxGap = 2.0;  // s

/** A body that turns about z at 0.5 rad/s and is accelerated along x of W at 2 m/s^2 for ever; both
 * sensors have a bias. */
struct Motion {
  ImuBias bias{{0.01, -0.02, 0.03}, {0.1, 0.2, -0.3}};

  NavState at(TimeNs t) const {
    const double s = 1e-9 * static_cast<double>(t);
    NavState state;
    state.T_WB = {expSO3({0.0, 0.0, 0.5 * s}), {s * s, 3.0 * s, 0.0}};
    state.v_WB = {2.0 * s, 3.0, 0.0};
    state.bias = bias;
    return state;
  }
  ImuSample sample(TimeNs t) const {
    ImuSample sample;
    sample.t = t;
    sample.gyro = Vector3d(0.0, 0.0, 0.5) + bias.gyro;
    sample.accel = at(t).T_WB.R.transpose() * Vector3d(2.0, 0.0, kGravityNorm) + bias.accel;
    return sample;
  }
};

class ImuPropagatorTest : public ::testing::Test {
 protected:
  void addUntil(TimeNs t) {
    for (; next_ <= t; next_ += kPeriod) propagator_.add(motion_.sample(next_));
  }
  /** Over less than a second the constant rate between samples turns the acceleration of 2 m/s^2 by
   * 0.5 rad/s * 2.5 ms at most, to both sides in turn: errors of 1e-6. */
  void expectTruthAt(TimeNs t) {
    const auto state = propagator_.at(t);
    ASSERT_TRUE(state) << t;
    const NavState truth = motion_.at(t);
    EXPECT_LT((state->T_WB.t - truth.T_WB.t).norm(), 1e-5) << t;
    EXPECT_LT((state->v_WB - truth.v_WB).norm(), 1e-5) << t;
    EXPECT_LT(angleBetween(state->T_WB.R.col(0), truth.T_WB.R.col(0)), 1e-7) << t;
    EXPECT_EQ(state->bias.gyro, motion_.bias.gyro);
    EXPECT_EQ(state->bias.accel, motion_.bias.accel);
  }

  Motion motion_;
  ImuPropagator propagator_{ImuNoiseDensities(), kGravityNorm, kMaxGap};
  TimeNs next_ = 0;
};

TEST_F(ImuPropagatorTest, FollowsTheMotionBetweenAndAheadOfEstimates) {
  addUntil(100'000'000);
  const TimeNs t0 = 52'000'000;  // between two samples
  propagator_.correct(t0, motion_.at(t0));
  for (const TimeNs t : {t0, t0 + 1, t0 + 1'234'567, TimeNs(100'000'000)}) expectTruthAt(t);
  addUntil(500'000'000);
  expectTruthAt(500'000'000);
}

TEST_F(ImuPropagatorTest, KnowsNothingOutsideOfWhatTheImuCovers) {
  EXPECT_FALSE(propagator_.at(0));
  EXPECT_EQ(propagator_.end(), 0);
  addUntil(100'000'000);
  EXPECT_FALSE(propagator_.at(50'000'000));  // no estimate yet
  propagator_.correct(50'000'000, motion_.at(50'000'000));
  EXPECT_EQ(propagator_.end(), 100'000'000);
  EXPECT_FALSE(propagator_.at(49'999'999));
  EXPECT_TRUE(propagator_.at(50'000'000));
  EXPECT_TRUE(propagator_.at(100'000'000));
  EXPECT_FALSE(propagator_.at(100'000'001));
  // An estimate of later than the samples: its own instant alone.
  propagator_.correct(120'000'000, motion_.at(120'000'000));
  EXPECT_EQ(propagator_.end(), 120'000'000);
  EXPECT_TRUE(propagator_.at(120'000'000));
  EXPECT_FALSE(propagator_.at(120'000'001));
}

TEST_F(ImuPropagatorTest, ANewEstimateTakesThePlaceOfTheOldOne) {
  addUntil(200'000'000);
  propagator_.correct(50'000'000, motion_.at(50'000'000));
  NavState aside = motion_.at(100'000'000);
  aside.T_WB.t += Vector3d(1.0, 2.0, 3.0);
  aside.v_WB += Vector3d(0.0, 0.0, 10.0);
  propagator_.correct(100'000'000, aside);
  EXPECT_FALSE(propagator_.at(99'000'000));
  const Vector3d moved = propagator_.at(150'000'000)->T_WB.t - motion_.at(150'000'000).T_WB.t;
  EXPECT_LT((moved - Vector3d(1.0, 2.0, 3.5)).norm(), 1e-5);
}

TEST_F(ImuPropagatorTest, ForgettingTheStateKeepsTheSamples) {
  addUntil(200'000'000);
  propagator_.correct(50'000'000, motion_.at(50'000'000));
  propagator_.forgetState();
  EXPECT_FALSE(propagator_.at(50'000'000));
  EXPECT_EQ(propagator_.end(), 200'000'000);
  propagator_.correct(100'000'000, motion_.at(100'000'000));
  expectTruthAt(200'000'000);
}

TEST_F(ImuPropagatorTest, IntegratesAcrossNoGapThatIsTooLong) {
  propagator_.correct(50'000'000, motion_.at(50'000'000));
  addUntil(100'000'000);
  next_ = 2'095'000'000;  // 1.995 s later: linear between the two, as everywhere
  addUntil(2'200'000'000);
  EXPECT_TRUE(propagator_.at(2'200'000'000));
  next_ = 5'000'000'000;
  addUntil(5'100'000'000);
  EXPECT_FALSE(propagator_.at(2'200'000'000));
  EXPECT_FALSE(propagator_.at(5'100'000'000));
  // An estimate within the gap is itself known, and says nothing of what is behind it.
  propagator_.correct(4'990'000'000, motion_.at(4'990'000'000));
  EXPECT_TRUE(propagator_.at(4'990'000'000));
  EXPECT_FALSE(propagator_.at(5'100'000'000));
  propagator_.correct(5'050'000'000, motion_.at(5'050'000'000));
  expectTruthAt(5'100'000'000);
}

TEST_F(ImuPropagatorTest, AnEstimateWithinAGapDoesNotBridgeIt) {
  addUntil(100'000'000);
  propagator_.correct(4'990'000'000, motion_.at(4'990'000'000));  // the images went on
  next_ = 5'000'000'000;
  addUntil(5'100'000'000);
  EXPECT_FALSE(propagator_.at(5'100'000'000));
}

TEST_F(ImuPropagatorTest, WithoutEstimatesForLongTheStateGoesAlongWithTheSamples) {
  propagator_.correct(0, motion_.at(0));
  // 4000 samples are 20 s; no more than these are kept, and the state is still known at the end.
  addUntil(60'000'000'000);
  const auto state = propagator_.at(60'000'000'000);
  ASSERT_TRUE(state);
  // Errors of 1e-6 m/s^2 in a minute, and those of 12,000 steps of turning.
  EXPECT_LT((state->T_WB.t - motion_.at(60'000'000'000).T_WB.t).norm(), 0.01);
  EXPECT_FALSE(propagator_.at(0));
}

TEST_F(ImuPropagatorTest, IntegratesNothingAcrossAJumpOfTheClockThatTheStampsDoNotShow) {
  propagator_.correct(0, motion_.at(0));
  addUntil(100'000'000);
  propagator_.clockJumped();
  addUntil(200'000'000);
  EXPECT_FALSE(propagator_.at(100'000'000));
  EXPECT_FALSE(propagator_.at(200'000'000));
  propagator_.correct(150'000'000, motion_.at(150'000'000));
  expectTruthAt(200'000'000);
}

TEST_F(ImuPropagatorTest, TheLastStateCostsNoMoreTheLongerAgoTheEstimateWas) {
  propagator_.correct(0, motion_.at(0));
  // The least of several tries: others use the machine, too.
  const auto cost_ms = [this](TimeNs until) {
    addUntil(until);
    double least = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < 5; ++trial) {
      Stopwatch watch;
      for (int k = 0; k < 50; ++k) EXPECT_TRUE(propagator_.at(until));
      least = std::min(least, watch.lapMilliseconds());
    }
    return least;
  };
  const double soon = cost_ms(50'000'000);
  EXPECT_LT(cost_ms(19'000'000'000), 20.0 * soon);  // 10 samples, and 3,800
}

}  // namespace
}  // namespace etalon
