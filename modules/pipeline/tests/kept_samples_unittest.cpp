#include "kept_samples.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

constexpr TimeNs kStep = kNanosecondsPerSecond / 10;

ImuSample at(TimeNs t) { return {t, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}; }

/** Seconds of samples that are kept after `seconds`. */
double kept(double seconds, const std::optional<TimeNs>& last_frame) {
  ImuBuffer imu;
  for (TimeNs t = kStep; t <= durationNs(seconds); t += kStep) keepSample(at(t), last_frame, &imu);
  return secondsBetween(imu.samples().front().t, imu.samples().back().t);
}

TEST(KeptSamples, AreThoseThatTheNextFrameMayNeed) {
  EXPECT_NEAR(kept(30.0, std::nullopt), 30.0, 0.2);
  EXPECT_NEAR(kept(300.0, std::nullopt), kLongestGapOfFramesS, 1.2);
  EXPECT_NEAR(kept(300.0, durationNs(5.0)), kLongestGapOfFramesS, 1.2);  // a long gap
}

TEST(KeptSamples, OfACameraWhoseClockIsAheadAreAsFew) {
  // Frames from an hour ahead: all samples are behind the last one, and still they have an end.
  for (const double seconds : {500.0, 540.0, 580.0}) {
    EXPECT_GT(kept(seconds, durationNs(3600.0)), kLongestGapOfFramesS - 1.2);
    EXPECT_LT(kept(seconds, durationNs(3600.0)), 2.0 * kLongestGapOfFramesS + 1.2);
  }
}

}  // namespace
}  // namespace etalon
