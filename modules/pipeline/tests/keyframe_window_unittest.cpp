#include "etalon/pipeline/keyframe_window.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using testing::SyntheticWindow;

constexpr TimeNs kFrameStep = 50'000'000;  // 20 Hz

TrackedFrame trackedAt(TimeNs t) {
  TrackedFrame frame;
  frame.t = t;
  return frame;
}

TEST(KeyframeWindow, KeepsTheLastKeyframesAndTheFramesBetweenThem) {
  KeyframeWindow window(3, 4.0);
  window.add(trackedAt(-kFrameStep), false);  // before the first keyframe: nobody asks for it
  std::vector<TimeNs> keyframes;
  for (int i = 0; i < 23; ++i) {
    const TimeNs t = i * kFrameStep;
    const bool keyframe = window.isKeyframe(t);
    if (keyframe) keyframes.push_back(t);
    window.add(trackedAt(t), keyframe);
    EXPECT_EQ(window.regularKeyframes(), std::min<int>(keyframes.size(), 3));
  }
  // 4 Hz of 20 Hz: every fifth frame, 0.0 s to 1.0 s.
  ASSERT_EQ(keyframes.size(), 5U);
  EXPECT_THAT(window.stamps(), ElementsAre(10 * kFrameStep, 15 * kFrameStep, 20 * kFrameStep));
}

TEST(KeyframeWindow, ClearForgetsTheFramesAndRestartTheRateAsWell) {
  KeyframeWindow window(2, 4.0);
  ASSERT_TRUE(window.isKeyframe(0));
  window.add(trackedAt(0), true);
  window.clear();
  EXPECT_TRUE(window.stamps().empty());
  EXPECT_FALSE(window.isKeyframe(kFrameStep));  // the next one is due at 0.25 s
  window.restart();
  EXPECT_TRUE(window.isKeyframe(2 * kFrameStep));
}

TEST(KeyframeWindow, KeyframesBeforeAStampLeaveWithTheirFrames) {
  KeyframeWindow window(5, 4.0);
  for (int i = 0; i <= 20; ++i) window.add(trackedAt(i * kFrameStep), i % 5 == 0);
  window.dropBefore(7 * kFrameStep);
  EXPECT_THAT(window.stamps(), ElementsAre(10 * kFrameStep, 15 * kFrameStep, 20 * kFrameStep));
  EXPECT_EQ(window.frames().size(), 11U);
  window.dropBefore(10 * kFrameStep);  // which stays
  EXPECT_EQ(window.stamps().size(), 3U);
  window.dropBefore(21 * kFrameStep);
  EXPECT_TRUE(window.stamps().empty());
  EXPECT_TRUE(window.frames().empty());
}

/** The stamps of the keyframes, in frames of 20 Hz. */
std::vector<int> framesOf(const KeyframeWindow& window) {
  std::vector<int> frames;
  for (const TimeNs t : window.stamps()) frames.push_back(static_cast<int>(t / kFrameStep));
  return frames;
}

/** Frames `first` to `last` of 20 Hz. */
void fly(int first, int last, KeyframeWindow* window) {
  for (int i = first; i <= last; ++i) {
    const bool keyframe = window->isKeyframe(i * kFrameStep);
    window->add(trackedAt(i * kFrameStep), keyframe);
  }
}

TEST(KeyframeWindow, AnAdditionalKeyframeComesBetweenThoseOfTheRate) {
  KeyframeWindow window(10, 4.0);
  fly(0, 10, &window);
  window.takeSooner(0.1);
  fly(11, 20, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(0, 5, 10, 12, 15, 20));
  EXPECT_EQ(window.regularKeyframes(), 5);
  // One of the rate comes first; then nothing is owed.
  window.takeSooner(0.3);
  fly(21, 32, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(0, 5, 10, 12, 15, 20, 25, 30));
}

TEST(KeyframeWindow, AnAdditionalKeyframeIsTheNearestFrame) {
  const auto taken = [](double rate_hz, double after_s) {
    KeyframeWindow window(10, 1.0);
    window.add(trackedAt(0), window.isKeyframe(0));
    window.takeSooner(after_s);
    TimeNs t = 0;
    for (int i = 1; window.stamps().size() < 2; ++i) {
      t = durationNs(i / rate_hz);
      window.add(trackedAt(t), window.isKeyframe(t));
    }
    return 1e-9 * static_cast<double>(t);
  };
  EXPECT_NEAR(taken(20.0, 0.1), 0.1, 1e-6);
  EXPECT_NEAR(taken(20.0, 0.1000001), 0.1, 1e-6);  // a stamp's last digits delay it by no frame
  EXPECT_NEAR(taken(20.0, 0.12), 0.1, 1e-6);
  EXPECT_NEAR(taken(20.0, 0.13), 0.15, 1e-6);
  EXPECT_NEAR(taken(30.0, 0.1), 0.1, 1e-6);
  EXPECT_NEAR(taken(6.0, 0.1), 1.0 / 6.0, 1e-6);
}

TEST(KeyframeWindow, BehindAnAdditionalKeyframeTheNextOneIsOfTheRate) {
  KeyframeWindow window(10, 4.0);
  fly(0, 10, &window);
  window.takeSooner(0.1);
  fly(11, 12, &window);
  window.takeSooner(0.1);
  fly(13, 15, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(0, 5, 10, 12, 15));
}

TEST(KeyframeWindow, AdditionalKeyframesDoNotShortenTheWindow) {
  KeyframeWindow window(4, 4.0);
  fly(0, 5, &window);
  window.takeSooner(0.1);
  fly(6, 14, &window);
  EXPECT_EQ(window.regularKeyframes(), 3);
  fly(15, 15, &window);
  EXPECT_EQ(window.regularKeyframes(), 4);
  EXPECT_THAT(framesOf(window), ElementsAre(0, 5, 7, 10, 15));
  fly(16, 20, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(5, 7, 10, 15, 20));
  fly(21, 25, &window);  // it begins with one of the rate
  EXPECT_THAT(framesOf(window), ElementsAre(10, 15, 20, 25));
  EXPECT_EQ(window.frames().size(), 16U);
  EXPECT_EQ(window.regularKeyframes(), 4);
}

TEST(KeyframeWindow, WhatIsForgottenOwesNoAdditionalKeyframe) {
  KeyframeWindow window(10, 4.0);
  window.takeSooner(0.1);  // nothing to come behind
  fly(0, 5, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(0, 5));
  window.takeSooner(0.1);
  window.clear();
  fly(6, 10, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(10));
  window.takeSooner(0.1);
  window.restart();
  fly(11, 16, &window);
  EXPECT_THAT(framesOf(window), ElementsAre(11, 16));
  window.takeSooner(0.1);
  fly(17, 21, &window);
  window.dropBefore(12 * kFrameStep);  // with the first goes nothing else
  EXPECT_THAT(framesOf(window), ElementsAre(16, 18, 21));
  window.dropBefore(17 * kFrameStep);
  EXPECT_THAT(framesOf(window), ElementsAre(21));
  EXPECT_EQ(window.regularKeyframes(), 1);
}

TEST(KeyframeWindow, OfAnImuThatEndsTooEarlyTheProblemHoldsWhatThereIs) {
  const SyntheticWindow synthetic = testing::makeSyntheticWindow({});
  KeyframeWindow window(4, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) window.add(frame, window.isKeyframe(frame.t));
  const TimeNs end = window.stamps().back() - durationNs(0.1);
  ImuBuffer imu;
  for (const ImuSample& sample : synthetic.imu.samples())
    if (sample.t <= end) imu.add(sample);
  for (const double offset_s : {0.0, 0.012}) {
    WindowOptions options;
    options.time_offset_s = offset_s;
    const InitializationProblem problem = window.problem(synthetic.calibration, {}, options, imu);
    ASSERT_FALSE(problem.imu().empty());
    EXPECT_EQ(problem.imu().samples().front().t, window.stamps().front());
    EXPECT_EQ(problem.imu().samples().back().t, imu.samples().back().t - durationNs(offset_s));
  }
}

TEST(KeyframeWindow, TheProblemHoldsItsFramesAndTheSamplesFromItsFirstToItsLastKeyframe) {
  const SyntheticWindow synthetic = testing::makeSyntheticWindow({});
  KeyframeWindow window(4, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) window.add(frame, window.isKeyframe(frame.t));
  ASSERT_EQ(window.regularKeyframes(), 4);
  const InitializationProblem problem =
      window.problem(synthetic.calibration, {}, {}, synthetic.imu);
  EXPECT_EQ(problem.keyframeCount(), 4);
  EXPECT_EQ(problem.frames().size(), 3U * 5U + 1U);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(problem.keyframe(k).t, synthetic.truth[6 + k].t);
    EXPECT_EQ(problem.keyframe(k).t, window.stamps()[k]);
  }
  const std::vector<ImuSample>& samples = problem.imu().samples();
  EXPECT_EQ(samples.front().t, window.stamps().front());
  EXPECT_EQ(samples.back().t, window.stamps().back());
}

TEST(KeyframeWindow, ATimeOffsetMovesTheSamplesToTheStampsOfTheImages) {
  const SyntheticWindow synthetic = testing::makeSyntheticWindow({});
  KeyframeWindow window(4, 4.0);
  for (const TrackedFrame& frame : synthetic.frames) window.add(frame, window.isKeyframe(frame.t));
  WindowOptions options;
  for (const double offset_s : {-0.012, 0.012}) {
    options.time_offset_s = offset_s;
    const TimeNs offset = durationNs(offset_s);
    const InitializationProblem problem =
        window.problem(synthetic.calibration, {}, options, synthetic.imu);
    const std::vector<ImuSample>& samples = problem.imu().samples();
    EXPECT_EQ(samples.front().t, window.stamps().front());
    EXPECT_EQ(samples.back().t, window.stamps().back());
    const std::vector<ImuSample> imu =
        synthetic.imu.between(window.stamps().front() + offset, synthetic.imu.samples().back().t);
    // Past the newest sample there is one more: the mean of as long before.
    for (size_t i = 0; i + 1 < samples.size(); ++i) {
      EXPECT_EQ(samples[i].t + offset, imu[i].t);
      EXPECT_EQ(samples[i].gyro, imu[i].gyro);
    }
    const Eigen::Vector3d newest = synthetic.imu.samples().back().gyro;
    if (offset_s > 0.0) {
      EXPECT_LT((samples.back().gyro - newest).norm(), 0.02);  // 2 rad/s^2
    }
  }
}

}  // namespace
}  // namespace etalon
