#include "etalon/imu/saturation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

/** Ten seconds of turning up to 2 rad/s and shaking up to 18 m/s^2, quantised as by 16 bits. */
std::vector<ImuSample> shaken(double gyro_limit, double accel_limit) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise;
  const auto cut = [](double value, double unit, double limit) {
    return std::min(limit, std::max(-limit, unit * std::round(value / unit)));
  };
  std::vector<ImuSample> samples;
  for (int i = 0; i < 2000; ++i) {
    const double t = 5e-3 * i;
    ImuSample s;
    s.t = durationNs(t);
    for (int a = 0; a < 3; ++a) {
      s.gyro[a] = cut(2.0 * std::sin((2.0 + a) * t) + 2e-3 * noise(random), 1e-3, gyro_limit);
      s.accel[a] = cut((a == 2 ? 9.81 : 0.0) + 8.0 * std::sin((3.0 + a) * t) + 0.03 * noise(random),
                       5e-3, accel_limit);
    }
    samples.push_back(s);
  }
  return samples;
}

TEST(Saturation, IsLearntFromRepeatedLargestValuesOfEitherSign) {
  SaturationDetector detector;
  int at_limit = 0, marked = 0, wrong = 0;
  for (ImuSample& sample : shaken(1.0, 12.0)) {
    detector.mark(&sample);
    for (int a = 0; a < 3; ++a) {
      const bool gyro = std::abs(sample.gyro[a]) == 1.0, accel = std::abs(sample.accel[a]) == 12.0;
      const bool gyro_marked = (sample.saturated & saturatedGyro(a)) != 0;
      const bool accel_marked = (sample.saturated & saturatedAccel(a)) != 0;
      at_limit += gyro + accel;
      marked += (gyro && gyro_marked) + (accel && accel_marked);
      wrong += (gyro_marked && !gyro) + (accel_marked && !accel);
    }
  }
  EXPECT_GT(at_limit, 1000);
  EXPECT_GE(marked, at_limit - 6 * (SaturationDetector::kTimes - 1));  // axes
  EXPECT_EQ(wrong, 0);
}

TEST(Saturation, NothingIsMarkedInMotionWithinTheRangeOrAtRest) {
  SaturationDetector detector;
  for (ImuSample& sample : shaken(100.0, 100.0)) EXPECT_FALSE(detector.mark(&sample));
  // At rest a coarse sensor repeats its values.
  SaturationDetector at_rest;
  for (int i = 0; i < 100; ++i) {
    ImuSample sample{durationNs(5e-3 * i), Vector3d(0.01, 0.0, -0.02), Vector3d(0.1, 0.0, 9.8)};
    EXPECT_FALSE(at_rest.mark(&sample));
  }
}

/** The accelerometer of a rig may have a fifth of the gyro's rate. */
TEST(Saturation, ValuesThatAreHeldUntilTheNextMeasurementAreNoLimit) {
  std::vector<ImuSample> samples = shaken(100.0, 1000.0);
  for (size_t i = 0; i < samples.size(); ++i) samples[i].accel = samples[i - i % 5].accel;
  SaturationDetector detector;
  for (ImuSample& sample : samples) EXPECT_FALSE(detector.mark(&sample)) << sample.t;
  // Where it is one, it is found all the same.
  samples = shaken(100.0, 16.0);
  for (size_t i = 0; i < samples.size(); ++i) samples[i].accel = samples[i - i % 5].accel;
  detector = SaturationDetector();
  int marked = 0;
  for (ImuSample& sample : samples) marked += detector.mark(&sample);
  EXPECT_GT(marked, 100);
}

TEST(Saturation, ALargerValueShowsThatItWasNoLimit) {
  SaturationDetector detector;
  std::vector<char> marked;
  for (const double rate : {1.0, 1.0, 1.0, 1.0, -1.0, 1.5, 1.0}) {
    ImuSample sample{durationNs(5e-3 * static_cast<double>(marked.size())),
                     Vector3d(rate, 0.0, 0.0), Vector3d::Zero()};
    marked.push_back(detector.mark(&sample));
  }
  EXPECT_EQ(marked, (std::vector<char>{0, 0, 0, 1, 1, 0, 0}));
}

/** Shaking reaches the end for a sample at a time. */
TEST(Saturation, IsLearntFromPeaksThatAreAllTheSame) {
  SaturationDetector detector;
  int marked = 0;
  for (int i = 0; i < 40; ++i) {
    ImuSample sample{durationNs(5e-3 * i), Vector3d::Zero(),
                     Vector3d(0.0, 0.0, i % 4 == 0 ? 12.0 : 8.0 + 0.01 * i)};
    marked += detector.mark(&sample);
  }
  EXPECT_EQ(marked, 10 - SaturationDetector::kTimes + 1);
}

TEST(Saturation, AGivenRangeNeedsNoRun) {
  SaturationDetector detector(1.0, 20.0);
  ImuSample sample{0, Vector3d(0.9, -1.0, 0.0), Vector3d(19.0, 0.0, 20.0)};
  EXPECT_TRUE(detector.mark(&sample));
  EXPECT_EQ(sample.saturated, saturatedGyro(1) | saturatedAccel(2));
}

TEST(Saturation, ItsAxesAreHardlyKnownInAPreintegrationAndTheOthersAsWellAsBefore) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= 40; ++i)
    samples.push_back({durationNs(5e-3 * i), Vector3d::Zero(), Vector3d(0.0, 0.0, 12.0)});
  const Preintegration plain(samples, {}, {});
  for (int i = 10; i < 20; ++i) samples[static_cast<size_t>(i)].saturated = saturatedAccel(2);
  const Preintegration saturated(samples, {}, {});
  EXPECT_EQ(plain.deltas().dv, saturated.deltas().dv);
  const Eigen::MatrixXd more = saturated.covariance() - plain.covariance();
  // 6 m/s^2 over a tenth of a second, as white noise in 0.05 s.
  EXPECT_NEAR(more(8, 8), 36.0 * 0.1 * 0.05, 1e-9);
  EXPECT_GT(more(5, 5), 0.0);
  EXPECT_NEAR((more.topLeftCorner<5, 5>().norm()), 0.0, 1e-12);
  // A gyro's, over to velocity and position, through the force.
  samples[15].gyro.x() = 1.0;
  samples[15].saturated = saturatedGyro(0);
  const Preintegration turned(samples, {}, {});
  EXPECT_GT(turned.covariance()(0, 0), 100.0 * plain.covariance()(0, 0));
  EXPECT_GT(turned.covariance()(7, 7), saturated.covariance()(7, 7));
}

TEST(Saturation, StaysWithWhatIsInterpolated) {
  ImuBuffer buffer;
  buffer.add({0, Vector3d::Zero(), Vector3d::Zero()});
  ImuSample end{10'000'000, Vector3d::Zero(), Vector3d::Zero()};
  end.saturated = saturatedGyro(2);
  buffer.add(end);
  const std::vector<ImuSample> cut = buffer.between(2'000'000, 4'000'000);
  ASSERT_EQ(cut.size(), 2U);
  EXPECT_EQ(cut[0].saturated, saturatedGyro(2));
}

}  // namespace
}  // namespace etalon
