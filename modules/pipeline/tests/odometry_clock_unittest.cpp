#include "odometry_clock.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

constexpr TimeNs kMs = 1'000'000;

TEST(OdometryClock, AcrossAJumpItTakesTheStepOfTheFramesBefore) {
  OdometryClock clock;
  clock.frame(0, 50 * kMs);
  clock.frameDone(50 * kMs, 55 * kMs);
  clock.jump(60 * kMs, 5060 * kMs);
  EXPECT_TRUE(clock.hasJumped());
  EXPECT_EQ(clock.jumpedTo(), 5060 * kMs);
  clock.frame(50 * kMs, 5100 * kMs);
  EXPECT_EQ(clock.at(5100 * kMs), 100 * kMs);
  clock.frameDone(5100 * kMs, 5105 * kMs);
  EXPECT_FALSE(clock.hasJumped());
}

TEST(OdometryClock, AFrameFromBeforeTheJumpThatComesAfterItLeavesTheJumpToTheNextOne) {
  OdometryClock clock;
  clock.frame(0, 50 * kMs);
  clock.frameDone(50 * kMs, 55 * kMs);
  clock.jump(105 * kMs, 5110 * kMs);
  clock.frame(50 * kMs, 100 * kMs);
  EXPECT_EQ(clock.at(100 * kMs), 100 * kMs);
  clock.frameDone(100 * kMs, 5115 * kMs);
  ASSERT_TRUE(clock.hasJumped());
  clock.frame(100 * kMs, 5150 * kMs);
  EXPECT_EQ(clock.at(5150 * kMs), 150 * kMs);
  clock.frameDone(5150 * kMs, 5155 * kMs);
  EXPECT_FALSE(clock.hasJumped());
}

TEST(OdometryClock, AJumpOfTheImuAloneIsForgotten) {
  OdometryClock clock;
  clock.jump(100 * kMs, 5100 * kMs);
  clock.frame(50 * kMs, 100 * kMs);
  clock.frameDone(100 * kMs, 5105 * kMs);
  EXPECT_TRUE(clock.hasJumped());
  clock.frame(1150 * kMs, 1200 * kMs);
  clock.frameDone(1200 * kMs, 6200 * kMs);
  EXPECT_FALSE(clock.hasJumped());
  EXPECT_EQ(clock.at(1200 * kMs), 1200 * kMs);
}

}  // namespace
}  // namespace etalon
