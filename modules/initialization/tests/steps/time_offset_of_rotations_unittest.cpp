#include "etalon/initialization/steps/time_offset_of_rotations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

/** A window and what of it may be wrong. */
struct Late {
  double offset_s = 0.0;    ///< the images are later, in the IMU's time, than their stamps
  double sigma_rad = 5e-4;  ///< of a keyframe's attitude
  double assumed_sigma_rad = 5e-4;
  double jitter_s = 0.0;             ///< of the stamps, a standard deviation
  double camera_rotation_rad = 0.0;  ///< error of the calibration
  Motion motion = Motion::kAggressive;
  int keyframes = 10;
};

Expected<RotationTimeOffset> found(const Late& late, unsigned seed) {
  SyntheticWindowOptions options;
  options.motion = late.motion;
  options.seed = seed;
  options.keyframes = late.keyframes;
  options.landmarks = 1;
  options.frames_per_keyframe = 1;
  options.gyro_noise_factor = options.accel_noise_factor = 1.0;
  options.bias = {{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};
  SyntheticWindow window = testing::makeSyntheticWindow(options);
  std::vector<ImuSample> samples = window.imu.samples();
  for (ImuSample& sample : samples) sample.t += durationNs(late.offset_s);
  window.imu = ImuBuffer(samples);

  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d turned = expSO3(late.camera_rotation_rad * Eigen::Vector3d::UnitX());
  VisualSolution visual;
  for (const StampedState& state : window.truth) {
    const double moved_s = late.jitter_s * normal(random);
    Eigen::Vector3d error(normal(random), normal(random), normal(random));
    error *= visual.T_VB.empty() ? 0.0 : late.sigma_rad;  // the first one is the gauge
    const auto rates = window.imu.between(state.t, state.t + 1);
    error += moved_s * (rates.empty() ? Eigen::Vector3d::Zero() : rates.front().gyro).eval();
    visual.T_VB.push_back(
        {turned.transpose() * state.T_WB.R * turned * expSO3(error), state.T_WB.t});
  }
  const Eigen::Index n = 6 * (visual.T_VB.size() - 1);
  visual.covariance = std::pow(late.assumed_sigma_rad, 2) * Eigen::MatrixXd::Identity(n, n);
  return timeOffsetOfRotations(makeProblem(window, options), visual);
}

/** Mean over windows of the squared error over the variance. */
double neesOf(const Late& late) {
  constexpr int kWindows = 40;
  double sum = 0.0;
  for (int run = 0; run < kWindows; ++run) {
    const auto offset = found(late, 60 + run);
    EXPECT_TRUE(offset.has_value()) << run;
    if (offset) sum += std::pow((offset->offset_s - late.offset_s) / offset->sigma_s, 2);
  }
  return sum / kWindows;
}

TEST(TimeOffsetOfRotations, IsWithinItsStandardDeviations) {
  for (const double offset_s : {-0.04, -0.01, 0.0, 0.005}) {
    const double nees = neesOf({offset_s});
    EXPECT_GT(nees, 0.5) << offset_s;  // 40 windows leave 22 %; a good fit does not narrow sigma
    EXPECT_LT(nees, 1.6) << offset_s;
  }
  for (const double offset_s : {-0.01, 0.02}) {
    const auto offset = found({offset_s}, 1);
    EXPECT_TRUE(offset->certain());
    EXPECT_LT(offset->sigma_s, 3e-4);
  }
}

TEST(TimeOffsetOfRotations, WidensWhereRotationsAreWorseThanTheirCovariance) {
  Late late{-0.01};
  late.sigma_rad = 4.0 * late.assumed_sigma_rad;
  const double nees = neesOf(late);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.8);  // chi2_per_dof of 23 degrees of freedom is itself known to 30 %
}

TEST(TimeOffsetOfRotations, IsNotCertainWithRightStamps) {
  Late late;
  for (unsigned seed = 1; seed < 60; ++seed) EXPECT_FALSE(found(late, seed)->certain());
  late.jitter_s = 2e-3;  // is no offset
  for (unsigned seed = 1; seed < 60; ++seed) EXPECT_FALSE(found(late, seed)->certain());
  late = {};
  late.camera_rotation_rad = radians(1.0);  // neither
  for (unsigned seed = 1; seed < 60; ++seed) EXPECT_FALSE(found(late, seed)->certain());
}

TEST(TimeOffsetOfRotations, NeedsMotionAndKeyframes) {
  Late late{-0.01};
  // At a constant rate an offset changes no rotation: noise alone determines it, badly.
  late.motion = Motion::kCircle;
  const auto even = found(late, 1);
  ASSERT_FALSE(even.has_value());
  EXPECT_EQ(even.error().status, RefusalStatus::kImplausible);
  EXPECT_GT(std::abs(*even.error().value), *even.error().bound);
  late = {-0.01};
  late.keyframes = 6;  // and of the five pairs the IMU covers four
  const auto few = found(late, 1);
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().status, RefusalStatus::kTooFewKeyframes);
  EXPECT_EQ(few.error().value, 4.0);
  // Farther than is looked for: the first step goes there already.
  const auto far = found({-0.3}, 1);
  ASSERT_FALSE(far.has_value());
  EXPECT_EQ(far.error().status, RefusalStatus::kImplausible);
  EXPECT_LT(*far.error().value, -*far.error().bound);
}

TEST(TimeOffsetOfRotations, IsNotCertainWhereTheRotationsDisagreeWithItOrItIsSmall) {
  EXPECT_TRUE((RotationTimeOffset{0.02, 3e-3, 9.0, 9}.certain()));
  EXPECT_FALSE((RotationTimeOffset{0.02, 3e-3, 11.0, 9}.certain()));
  EXPECT_FALSE((RotationTimeOffset{0.02, 4e-3, 1.0, 9}.certain()));
  EXPECT_FALSE((RotationTimeOffset{-1.9e-3, 1e-5, 1.0, 9}.certain()));
}

TEST(TimeOffsetOfRotations, SaysWhichWay) {
  EXPECT_EQ((RotationTimeOffset{-0.0101, 2e-4, 1.0, 9}.inWords()),
            "the stamps of the images are 10.1 ms (+- 0.2) too late");
  EXPECT_THAT((RotationTimeOffset{0.005, 1e-4, 1.0, 9}.inWords()),
              HasSubstr("5.0 ms (+- 0.1) too early"));
}

}  // namespace
}  // namespace etalon
