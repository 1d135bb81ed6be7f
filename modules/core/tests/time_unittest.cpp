#include "etalon/core/time.h"

#include <gtest/gtest.h>

#include <limits>

namespace etalon {
namespace {

constexpr TimeNs kStamp = 1'403'636'579'763'555'584;  // an absolute one, as EuRoC's

TEST(Time, LosesNoNanosecond) {
  EXPECT_EQ(secondsBetween(kStamp, kStamp + 1), 1e-9);
  EXPECT_EQ(secondsBetween(kStamp + 5'000'000, kStamp), -0.005);
  EXPECT_EQ(durationNs(secondsBetween(kStamp, kStamp + 123'456'789)), 123'456'789);
}

TEST(Time, DurationsAreRoundedToTheNearest) {
  EXPECT_EQ(durationNs(0.005), 5'000'000);
  EXPECT_EQ(durationNs(-0.25), -250'000'000);
  EXPECT_EQ(durationNs(1.0000000006), 1'000'000'001);
  EXPECT_EQ(durationNs(-0.0000000006), -1);
}

TEST(Time, StampsAreCutDownToMrptsTick) {
  EXPECT_EQ(truncateToMrptTick(kStamp), kStamp - 84);
  EXPECT_EQ(truncateToMrptTick(kStamp - 84), kStamp - 84);
}

TEST(Time, StampsReachFromZeroToTheLastOne) {
  EXPECT_TRUE(isStamp(0) && isStamp(kLastStamp));
  EXPECT_FALSE(isStamp(-1) || isStamp(kLastStamp + 1));
  // Room for differences beyond it.
  EXPECT_EQ(secondsBetween(kLastStamp, kLastStamp + 250'000'000), 0.25);
  EXPECT_GT(std::numeric_limits<TimeNs>::max() - kLastStamp, kLastStamp);
}

}  // namespace
}  // namespace etalon
