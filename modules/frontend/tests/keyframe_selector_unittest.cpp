#include "etalon/frontend/keyframe_selector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace etalon {
namespace {

constexpr TimeNs kStart = 1'403'636'579'763'555'584;  // an absolute stamp, as EuRoC's

std::vector<TimeNs> regular(double rate_hz, int frames) {
  std::vector<TimeNs> stamps;
  for (int i = 0; i < frames; ++i) stamps.push_back(kStart + durationNs(i / rate_hz));
  return stamps;
}

std::vector<TimeNs> select(const std::vector<TimeNs>& stamps, double rate_hz) {
  KeyframeSelector selector(KeyframeSelectorOptions{rate_hz});
  std::vector<TimeNs> keyframes;
  for (const TimeNs t : stamps)
    if (selector.isKeyframe(t)) keyframes.push_back(t);
  return keyframes;
}

TEST(KeyframeSelector, TakesEveryFifthFrameOfTwentyHertz) {
  const std::vector<TimeNs> keyframes = select(regular(20.0, 101), 4.0);
  ASSERT_EQ(keyframes.size(), 21U);
  for (size_t k = 0; k < keyframes.size(); ++k)
    EXPECT_EQ(keyframes[k], kStart + durationNs(0.25 * static_cast<double>(k)));
}

TEST(KeyframeSelector, DoesNotDriftWhereTheRatesDoNotDivide) {
  const std::vector<TimeNs> keyframes = select(regular(30.0, 30 * 100 + 1), 4.0);
  ASSERT_EQ(keyframes.size(), 401U);
  for (size_t k = 0; k < keyframes.size();
       ++k)  // half a frame interval, and a nanosecond of rounding
    EXPECT_LE(std::abs(secondsBetween(kStart, keyframes[k]) - 0.25 * static_cast<double>(k)),
              0.5 / 30.0 + 2e-9);
}

TEST(KeyframeSelector, TakesTheNearestFrameDespiteJitter) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-0.005, 0.005);
  std::vector<TimeNs> stamps = regular(20.0, 2001);
  for (size_t i = 1; i < stamps.size(); ++i) stamps[i] += durationNs(jitter(random));
  const std::vector<TimeNs> keyframes = select(stamps, 4.0);
  ASSERT_EQ(keyframes.size(), 401U);
  for (size_t k = 0; k < keyframes.size();
       ++k)  // the frame meant for that instant, 50 ms from its neighbours
    EXPECT_LT(std::abs(secondsBetween(kStart, keyframes[k]) - 0.25 * static_cast<double>(k)),
              0.0051);
}

TEST(KeyframeSelector, GoesOnAtOnceAfterAGap) {
  std::vector<TimeNs> stamps = regular(20.0, 41);
  // The camera is silent for 10 s, then goes on.
  for (int i = 0; i <= 40; ++i) stamps.push_back(kStart + durationNs(12.0 + i / 20.0));
  const std::vector<TimeNs> keyframes = select(stamps, 4.0);
  std::vector<double> after;
  for (const TimeNs t : keyframes)
    if (t >= kStart + durationNs(12.0)) after.push_back(secondsBetween(kStart, t));
  ASSERT_EQ(after.size(), 9U);
  for (size_t k = 0; k < after.size(); ++k)
    EXPECT_NEAR(after[k], 12.0 + 0.25 * static_cast<double>(k), 1e-8);
}

TEST(KeyframeSelector, OneLostFrameCostsNoKeyframe) {
  for (const size_t lost : {4U, 5U, 6U, 7U}) {
    std::vector<TimeNs> stamps = regular(20.0, 41);
    stamps.erase(stamps.begin() + lost);
    const std::vector<TimeNs> keyframes = select(stamps, 4.0);
    ASSERT_EQ(keyframes.size(), 9U) << lost;
    for (size_t k = 0; k < keyframes.size(); ++k)  // at worst the neighbour of the lost frame
      EXPECT_NEAR(secondsBetween(kStart, keyframes[k]), 0.25 * static_cast<double>(k), 0.0501)
          << lost;
  }
}

TEST(KeyframeSelector, AJumpOfTheStampsTakesNoTime) {
  // From 1970, the clock of a device that has just started, to 2026: two billion instants at 1 kHz;
  // counted one by one they would take a minute.
  constexpr TimeNs kFrom = 1'000'000'000, kTo = 1'767'225'600'000'000'000;
  for (const double rate_hz : {4.0, 1000.0}) {
    KeyframeSelector selector({rate_hz});
    EXPECT_TRUE(selector.isKeyframe(kFrom));
    EXPECT_TRUE(selector.isKeyframe(kTo));
    // The instants go on from the first stamp.
    int keyframes = 0;
    for (int i = 1; i <= 40; ++i) keyframes += selector.isKeyframe(kTo + i * 50'000'000);
    EXPECT_EQ(keyframes, rate_hz < 20.0 ? 8 : 40);
  }
}

TEST(KeyframeSelector, TakesEveryFrameWhereKeyframesAreWantedFaster) {
  EXPECT_EQ(select(regular(20.0, 50), 20.0).size(), 50U);
  EXPECT_EQ(select(regular(20.0, 50), 100.0).size(), 50U);
}

}  // namespace
}  // namespace etalon
