// The generator behind all simulated noise: its distributions and its streams.

#include "random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace etalon {
namespace {

constexpr int kDraws = 40'000;

TEST(Random, IsSplitMix64) {
  // The reference implementation's first outputs for the seed 0 (Vigna, splitmix64.c).
  EXPECT_EQ(mixBits(0), 0xe220a8397b1dcdafULL);
  EXPECT_EQ(mixBits(0x9e3779b97f4a7c15ULL), 0x6e789e6aa1b965f4ULL);
  EXPECT_EQ(mixBits(2 * 0x9e3779b97f4a7c15ULL), 0x06c45d188009454fULL);
}

TEST(Random, UniformIsInItsIntervalAndEven) {
  Random random(1, kMotionStream);
  std::array<int, 10> tenths{};
  double sum = 0.0, squares = 0.0, lag = 0.0, last = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.uniform();
    ASSERT_GE(x, 0.0);
    ASSERT_LT(x, 1.0);
    ++tenths[static_cast<size_t>(10.0 * x)];
    sum += x;
    squares += (x - 0.5) * (x - 0.5);
    lag += (x - 0.5) * last;
    last = x - 0.5;
  }
  // Five standard deviations: of the mean sqrt(1/12 / n), of a count sqrt(0.09 n), ...
  const double n = kDraws;
  EXPECT_NEAR(sum / n, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / n));
  EXPECT_NEAR(squares / n, 1.0 / 12.0, 5.0 * std::sqrt(1.0 / 180.0 / n));
  EXPECT_NEAR(lag / n, 0.0, 5.0 / 12.0 / std::sqrt(n));
  for (const int count : tenths) EXPECT_NEAR(count, 0.1 * n, 5.0 * std::sqrt(0.09 * n));
}

TEST(Random, UniformBetweenAndWholeNumbersReachAllAndNoMore) {
  Random random(2, kRoomStream);
  std::array<int, 4> counts{};
  double least = 1e9, most = -1e9;
  for (int i = 0; i < kDraws; ++i) {
    const int k = random.uniformInt(4);
    ASSERT_GE(k, 0);
    ASSERT_LT(k, 4);
    ++counts[k];
    const double x = random.uniform(-3.0, 5.0);
    least = std::min(least, x);
    most = std::max(most, x);
  }
  for (const int count : counts) EXPECT_NEAR(count, 0.25 * kDraws, 5.0 * std::sqrt(0.19 * kDraws));
  EXPECT_GE(least, -3.0);
  EXPECT_LT(least, -2.99);
  EXPECT_LT(most, 5.0);
  EXPECT_GT(most, 4.99);
}

TEST(Random, NormalHasTheMomentsOfAGaussian) {
  Random random(3, kImuNoiseStream);
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    m1 += x / kDraws;
    m2 += x * x / kDraws;
    m3 += x * x * x / kDraws;
    m4 += x * x * x * x / kDraws;
  }
  // Their variances are 1, 2, 15 and 96 over n.
  const double root = std::sqrt(static_cast<double>(kDraws));
  EXPECT_NEAR(m1, 0.0, 5.0 / root);
  EXPECT_NEAR(m2, 1.0, 5.0 * std::sqrt(2.0) / root);
  EXPECT_NEAR(m3, 0.0, 5.0 * std::sqrt(15.0) / root);
  EXPECT_NEAR(m4, 3.0, 5.0 * std::sqrt(96.0) / root);
}

TEST(Random, DirectionsAreOfUnitLengthAndPointEverywhere) {
  Random random(4, kBiasStream);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector3d d = random.direction();
    ASSERT_NEAR(d.norm(), 1.0, 1e-12);
    mean += d / kDraws;
    spread += d * d.transpose() / kDraws;
  }
  // Every component has a variance of 1/3.
  const double band = 5.0 / std::sqrt(static_cast<double>(kDraws));
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), band * std::sqrt(1.0 / 3.0));
  EXPECT_LT((spread - Eigen::Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), band * 0.3);
}

TEST(Random, StreamsOfOneSeedHaveNothingInCommon) {
  Random same(7, kTrackStream), again(7, kTrackStream), other(7, kTextureStream),
      seed(8, kTrackStream);
  double with_other = 0.0, with_seed = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = same.normal();
    EXPECT_EQ(x, again.normal());
    with_other += x * other.normal() / kDraws;
    with_seed += x * seed.normal() / kDraws;
  }
  const double band = 5.0 / std::sqrt(static_cast<double>(kDraws));
  EXPECT_NEAR(with_other, 0.0, band);
  EXPECT_NEAR(with_seed, 0.0, band);
}

}  // namespace
}  // namespace etalon
