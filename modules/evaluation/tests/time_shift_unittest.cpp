#include "etalon/evaluation/time_shift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

constexpr double kShift = -0.017;  // s

/** A flight at 20 Hz with an error of its own of about 1 cm, and its truth at 100 Hz, late. */
struct LateFlight {
  Trajectory estimate;
  GroundTruth truth;
};

LateFlight lateFlight(std::uint64_t seed) {
  ProfileOptions options;
  options.profile = MotionProfile::kAggressive;
  options.seed = seed;
  options.duration_s = 30.0;
  const ProfileTrajectory motion(options);
  const SE3 T_VW(expSO3(Eigen::Vector3d(0.0, 0.0, 1.0)), Eigen::Vector3d(1.0, 2.0, 3.0));
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();
  LateFlight result;
  for (int k = 20; k < 2900; ++k) {
    const TimeNs t = options.start + durationNs(0.01 * k);
    result.truth.states.emplace_back(t, motion.at(t + durationNs(kShift)).T_WB);
    if (k % 5 != 0) continue;
    for (int i = 0; i < 3; ++i) drift[i] = 0.98 * drift[i] + 0.002 * normal(random);
    SE3 pose = T_VW * motion.at(t).T_WB;
    pose.t += drift;
    result.estimate.push_back({t, pose});
  }
  return result;
}

TEST(TimeShift, IsFoundWithinItsStandardError) {
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const LateFlight one = lateFlight(seed);
    const auto shift = estimateTimeShift(one.estimate, one.truth);
    ASSERT_TRUE(shift);
    EXPECT_LT(shift->sigma_s, 3e-3);
    EXPECT_LT(shift->after.position_m.rmse, shift->before.position_m.rmse);
    squares += std::pow((shift->shift_s - kShift) / shift->sigma_s, 2.0) / 6.0;
  }
  EXPECT_LT(squares, 2.6);  // chi-square of six degrees of freedom: exceeded once in sixty times
}

/** 30 s along a path, position over seconds, at 20 Hz, and the truth at 100 Hz, late. */
LateFlight along(const std::function<Eigen::Vector3d(double)>& path, double noise_m = 0.0) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  LateFlight result;
  for (int k = 0; k <= 3000; ++k) {
    const TimeNs t = durationNs(0.01 * k);
    Eigen::Vector3d p = path(0.01 * k + kShift);
    for (int i = 0; i < 3; ++i) p[i] += noise_m * normal(random);
    result.truth.states.emplace_back(t, SE3(Eigen::Matrix3d::Identity(), p));
    if (k % 5 == 0)
      result.estimate.push_back({t, SE3(Eigen::Matrix3d::Identity(), path(0.01 * k))});
  }
  return result;
}

TEST(TimeShift, IsRefusedWhereAnAlignmentDoesTheSame) {
  const auto straight = [](double s) { return Eigen::Vector3d(1.0 * s, 2.0, 0.1 * s); };
  const auto circle = [](double s) { return Eigen::Vector3d(std::cos(s), std::sin(s), 0.0); };
  // 1 mm of a tracker at 100 Hz: the differences that give the velocity make 1.5 % of it noise.
  for (const LateFlight& one : {along(straight), along(circle), along(straight, 1e-3)}) {
    const auto shift = estimateTimeShift(one.estimate, one.truth);
    ASSERT_FALSE(shift);
    EXPECT_EQ(shift.error().status, RefusalStatus::kTooLittleMotion);
    EXPECT_EQ(shift.error().bound, 0.02);
  }
}

TEST(TimeShift, IsFoundOnAStraightLineWhereTheSpeedChanges) {
  const LateFlight one =
      along([](double s) { return Eigen::Vector3d(1.0 * s + std::sin(s), 2.0, 0.0); });
  const auto shift = estimateTimeShift(one.estimate, one.truth);
  ASSERT_TRUE(shift);
  // Linear interpolation of the truth: up to (10 ms)^2 / 8 times 1 m/s^2, 12.5 um, at about 1 m/s.
  EXPECT_NEAR(shift->shift_s, kShift, 2e-5);
}

TEST(TimeShift, RestIsRefused) {
  LateFlight one = lateFlight(1);
  for (StampedState& state : one.truth.states) state.T_WB = SE3();
  const auto shift = estimateTimeShift(one.estimate, one.truth);
  ASSERT_FALSE(shift);
  EXPECT_EQ(shift.error().status, RefusalStatus::kTooLittleMotion);
  one.estimate.resize(10);
  EXPECT_EQ(estimateTimeShift(one.estimate, one.truth).error().bound, 30.0);
}

}  // namespace
}  // namespace etalon
