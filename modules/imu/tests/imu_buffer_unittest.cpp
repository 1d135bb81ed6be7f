#include "etalon/imu/imu_buffer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

/** A signal linear in time, which linear interpolation gives back exactly (up to rounding). */
ImuSample linearSample(TimeNs t) {
  const double s = static_cast<double>(t);
  return {t, Vector3d(s, -2 * s, 3), Vector3d(1, s, 0.5 * s)};
}

ImuBuffer linearBuffer(const std::vector<TimeNs>& stamps) {
  ImuBuffer buffer;
  for (TimeNs t : stamps) buffer.add(linearSample(t));
  return buffer;
}

std::vector<TimeNs> stampsOf(const std::vector<ImuSample>& samples) {
  std::vector<TimeNs> stamps;
  stamps.reserve(samples.size());
  for (const ImuSample& s : samples) stamps.push_back(s.t);
  return stamps;
}

using Stamps = std::vector<TimeNs>;

TEST(ImuBuffer, RefusesStampsThatDoNotIncrease) {
  EXPECT_THROW(ImuBuffer({linearSample(20), linearSample(10)}), DataError);
  EXPECT_THROW(ImuBuffer({linearSample(20), linearSample(20)}), DataError);
  ImuBuffer buffer({linearSample(10), linearSample(20)});
  EXPECT_THROW(buffer.add(linearSample(20)), DataError);
  EXPECT_THROW(buffer.add(linearSample(15)), DataError);
  EXPECT_EQ(buffer.samples().size(), 2u);
  EXPECT_NO_THROW(buffer.add(linearSample(21)));
}

TEST(ImuBuffer, CoversWhatWasRecorded) {
  EXPECT_FALSE(ImuBuffer().covers(0, 0));
  const ImuBuffer buffer = linearBuffer({10, 20, 30});
  EXPECT_TRUE(buffer.covers(10, 30));
  EXPECT_TRUE(buffer.covers(12, 12));
  EXPECT_FALSE(buffer.covers(9, 30));
  EXPECT_FALSE(buffer.covers(10, 31));
  EXPECT_FALSE(buffer.covers(20, 15));
}

TEST(ImuBuffer, CutsAtRecordedStamps) {
  const ImuBuffer buffer = linearBuffer({10, 20, 30, 40, 50});
  EXPECT_EQ(stampsOf(buffer.between(20, 40)), (Stamps{20, 30, 40}));
  EXPECT_EQ(stampsOf(buffer.between(10, 50)), (Stamps{10, 20, 30, 40, 50}));
  EXPECT_EQ(stampsOf(buffer.between(30, 40)), (Stamps{30, 40}));
}

TEST(ImuBuffer, InterpolatesTheEnds) {
  const ImuBuffer buffer = linearBuffer({10, 20, 30, 45, 50});
  const std::vector<ImuSample> cut = buffer.between(13, 41);
  EXPECT_EQ(stampsOf(cut), (Stamps{13, 20, 30, 41}));
  for (const ImuSample& s : cut) {
    EXPECT_TRUE(s.gyro.isApprox(linearSample(s.t).gyro, 1e-14));
    EXPECT_TRUE(s.accel.isApprox(linearSample(s.t).accel, 1e-14));
  }
  EXPECT_EQ(stampsOf(buffer.between(32, 44)), (Stamps{32, 44}));  // within one step
  EXPECT_EQ(stampsOf(buffer.between(10, 11)), (Stamps{10, 11}));
  EXPECT_EQ(stampsOf(buffer.between(49, 50)), (Stamps{49, 50}));
}

TEST(ImuBuffer, InterpolatesAtNanosecondsOfAnAbsoluteClock) {
  const TimeNs t0 = 1'403'636'579'763'555'584;
  const ImuBuffer buffer({{t0, Vector3d::Zero(), Vector3d::Zero()},
                          {t0 + 5'000'000, Vector3d::Ones(), Vector3d::Ones()}});
  const std::vector<ImuSample> cut = buffer.between(t0 + 1, t0 + 4'999'999);
  ASSERT_EQ(cut.size(), 2u);
  EXPECT_NEAR(cut[0].gyro.x(), 2e-7, 1e-15);
  EXPECT_NEAR(1.0 - cut[1].gyro.x(), 2e-7, 1e-15);
}

TEST(ImuBuffer, CutsNothingWhereItDoesNotCover) {
  const ImuBuffer buffer = linearBuffer({10, 20, 30});
  EXPECT_TRUE(buffer.between(5, 20).empty());
  EXPECT_TRUE(buffer.between(20, 31).empty());
  EXPECT_TRUE(buffer.between(20, 20).empty());
  EXPECT_TRUE(buffer.between(25, 20).empty());
  EXPECT_TRUE(ImuBuffer().between(0, 1).empty());
}

TEST(ImuBuffer, DropsWhatNoLaterIntervalNeeds) {
  ImuBuffer buffer = linearBuffer({10, 20, 30, 40});
  buffer.dropBefore(5);
  EXPECT_EQ(stampsOf(buffer.samples()), (Stamps{10, 20, 30, 40}));
  buffer.dropBefore(25);
  EXPECT_EQ(stampsOf(buffer.samples()), (Stamps{20, 30, 40}));
  EXPECT_EQ(stampsOf(buffer.between(25, 40)), (Stamps{25, 30, 40}));
  buffer.dropBefore(30);
  EXPECT_EQ(stampsOf(buffer.samples()), (Stamps{30, 40}));
  buffer.dropBefore(1000);
  EXPECT_EQ(stampsOf(buffer.samples()), (Stamps{40}));
  ImuBuffer empty;
  empty.dropBefore(1000);
  EXPECT_TRUE(empty.empty());
}

TEST(ImuBuffer, FindsTheLongestGap) {
  const ImuBuffer buffer = linearBuffer({0, 10, 20, 60, 70});
  EXPECT_DOUBLE_EQ(buffer.longestGap(0, 70), 40e-9);
  EXPECT_DOUBLE_EQ(buffer.longestGap(0, 20), 10e-9);
  EXPECT_DOUBLE_EQ(buffer.longestGap(0, 45), 25e-9);   // cut within the gap
  EXPECT_DOUBLE_EQ(buffer.longestGap(30, 55), 25e-9);  // all within it
  EXPECT_DOUBLE_EQ(buffer.longestGap(50, 70), 10e-9);
  EXPECT_TRUE(std::isinf(buffer.longestGap(0, 71)));
  EXPECT_TRUE(std::isinf(buffer.longestGap(10, 10)));
}

}  // namespace
}  // namespace etalon
