#include "etalon/pipeline/input_border.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <opencv2/core.hpp>

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kSecond = kNanosecondsPerSecond;

StereoInertialCalibration smallCameras() {
  StereoInertialCalibration calibration;
  for (CameraCalibration& camera : calibration.cameras) {
    camera.model = CameraModel("pinhole", "none", 8, 4, {8.0, 8.0, 3.5, 1.5}, {});
  }
  return calibration;
}

ImuSample sampleAt(TimeNs t) { return {t, Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(0, 0, 9.8)}; }

StereoFrame frameAt(TimeNs t) {
  StereoFrame frame;
  frame.t = t;
  frame.left = cv::Mat::zeros(4, 8, CV_8UC1);
  frame.right = cv::Mat::zeros(4, 8, CV_8UC1);
  return frame;
}

class InputBorderTest : public ::testing::Test {
 protected:
  /** What has passed since the last call: stamps, ms; frames as negative numbers, jumps as 0. */
  std::vector<TimeNs> passed() {
    std::vector<TimeNs> stamps;
    while (const auto input = border.next()) {
      if (const auto* sample = std::get_if<ImuSample>(&*input))
        stamps.push_back(sample->t / kMs);
      else if (const auto* frame = std::get_if<StereoFrame>(&*input))
        stamps.push_back(-frame->t / kMs);
      else
        stamps.push_back(0);
    }
    return stamps;
  }
  int count(InputFault fault) const {
    const auto found = border.faults().find(fault);
    return found == border.faults().end() ? 0 : found->second.count;
  }

  InputBorder border{smallCameras(), InputOptions()};
};

TEST_F(InputBorderTest, AfterSeveralFramesWithoutImuTheNextOnesDoNotWait) {
  border.add(sampleAt(5 * kMs));
  border.add(sampleAt(10 * kMs));
  for (TimeNs t = 50; t <= 1250; t += 50) border.add(frameAt(t * kMs));
  EXPECT_EQ(passed(), (std::vector<TimeNs>{5, 10, -50, -100, -150, -200}));  // a second behind
  border.add(frameAt(1300 * kMs));  // the fifth: all that wait pass
  EXPECT_EQ(passed().size(), 22U);
  border.add(frameAt(1350 * kMs));
  EXPECT_THAT(passed(), ElementsAre(-1350));
  // With the next sample they wait again.
  border.add(sampleAt(1355 * kMs));
  border.add(frameAt(1400 * kMs));
  EXPECT_THAT(passed(), ElementsAre(1355));
}

TEST_F(InputBorderTest, WhereOneImageIsMissingTheOtherIsUsed) {
  StereoFrame frame = frameAt(50 * kMs);
  frame.right = cv::Mat();
  border.add(frame);
  border.finish();
  const auto input = border.next();
  ASSERT_TRUE(input);
  EXPECT_EQ(std::get<StereoFrame>(*input).right.size(), cv::Size(8, 4));
  EXPECT_EQ(cv::countNonZero(std::get<StereoFrame>(*input).right), 0);
  EXPECT_EQ(count(InputFault::kFrameOfOneCamera), 1);
}

TEST_F(InputBorderTest, AFrameWaitsForTheImuAndGoodInputHasNoFaults) {
  border.add(sampleAt(5 * kMs));
  border.add(frameAt(12 * kMs));
  border.add(sampleAt(10 * kMs));
  EXPECT_THAT(passed(), ElementsAre(5, 10));
  border.add(sampleAt(15 * kMs));
  border.add(frameAt(14 * kMs));
  EXPECT_THAT(passed(), ElementsAre(15, -12, -14));
  border.finish();
  EXPECT_THAT(passed(), IsEmpty());
  EXPECT_THAT(border.faults(), IsEmpty());
}

TEST_F(InputBorderTest, SamplesThatAreNoMeasurementsAreDroppedAndCounted) {
  border.add(sampleAt(5 * kMs));
  ImuSample bad = sampleAt(10 * kMs);
  bad.gyro.y() = std::numeric_limits<double>::quiet_NaN();
  border.add(bad);
  bad = sampleAt(11 * kMs);
  bad.gyro.z() = 1e30;
  border.add(bad);
  bad = sampleAt(12 * kMs);
  bad.accel.x() = -std::numeric_limits<double>::infinity();
  border.add(bad);
  border.add(sampleAt(5 * kMs + 30));  // the tick of the first
  border.add(sampleAt(4 * kMs));
  border.add(sampleAt(std::numeric_limits<TimeNs>::max()));
  border.add(sampleAt(15 * kMs));
  EXPECT_THAT(passed(), ElementsAre(5, 15));
  EXPECT_EQ(count(InputFault::kImuNotFinite), 2);
  EXPECT_EQ(count(InputFault::kImuTooLarge), 1);
  EXPECT_EQ(border.faults().at(InputFault::kImuTooLarge).value, 1e30);
  EXPECT_EQ(border.faults().at(InputFault::kImuTooLarge).first, 11 * kMs);
  EXPECT_EQ(count(InputFault::kImuRepeatedStamp), 1);
  EXPECT_EQ(count(InputFault::kImuFromThePast), 1);
  EXPECT_EQ(count(InputFault::kImuInvalidStamp), 1);
}

TEST_F(InputBorderTest, FramesThatCannotBeUsedAreDroppedAndCounted) {
  border.add(sampleAt(1000 * kMs));
  border.add(frameAt(100 * kMs));
  border.add(frameAt(50 * kMs));
  border.add(frameAt(100 * kMs + 60));   // the same tick
  border.add(frameAt(100 * kMs + 120));  // the next tick: no camera is that fast
  StereoFrame bad = frameAt(120 * kMs);
  bad.left = bad.right = cv::Mat();
  border.add(bad);
  bad = frameAt(130 * kMs);
  bad.left = cv::Mat::zeros(4, 8, CV_8UC3);
  border.add(bad);
  border.add(frameAt(std::numeric_limits<TimeNs>::min()));
  border.add(frameAt(150 * kMs));
  EXPECT_THAT(passed(), ElementsAre(1000, -100, -150));
  EXPECT_EQ(count(InputFault::kFrameFromThePast), 1);
  EXPECT_EQ(count(InputFault::kFrameRepeatedStamp), 2);
  EXPECT_EQ(count(InputFault::kFrameUnusable), 2);
  EXPECT_EQ(count(InputFault::kFrameInvalidStamp), 1);
}

TEST_F(InputBorderTest, FramesDoNotWaitForEverForAnImuThatEnded) {
  border.add(sampleAt(100 * kMs));
  for (int k = 0; k < 600; ++k) border.add(frameAt((150 + 50 * k) * kMs));
  EXPECT_EQ(passed().size() - 1, 600U);
  EXPECT_EQ(count(InputFault::kFrameWithoutImu), 600);
  // However dense they come.
  for (const TimeNs t : {30'200, 30'205}) border.add(sampleAt(t * kMs));
  passed();
  const auto max_waiting = static_cast<TimeNs>(InputBorder::kMaxWaitingFrames);
  for (TimeNs k = 0; k < max_waiting; ++k) border.add(frameAt(30'300 * kMs + k * kMs / 10));
  EXPECT_THAT(passed(), IsEmpty());
  border.add(frameAt(30'300 * kMs + max_waiting * kMs / 10));
  EXPECT_EQ(passed().size(), 1U);
}

TEST_F(InputBorderTest, AJumpOfTheClockIsToldBeforeWhatComesAfterIt) {
  const TimeNs jump = 100'000'000 * kSecond;
  border.add(sampleAt(5 * kMs));
  border.add(frameAt(8 * kMs));
  border.add(sampleAt(jump + 10 * kMs));  // might stand alone
  EXPECT_THAT(passed(), ElementsAre(5));
  border.add(sampleAt(jump + 15 * kMs));
  EXPECT_THAT(passed(), ElementsAre(-8, 0, (jump + 10 * kMs) / kMs, (jump + 15 * kMs) / kMs));
  border.add(frameAt(jump + 12 * kMs));
  border.add(frameAt(jump + 14 * kMs));
  EXPECT_THAT(passed(), ElementsAre(-(jump + 12 * kMs) / kMs, -(jump + 14 * kMs) / kMs));
  EXPECT_EQ(count(InputFault::kImuJump), 1);
  EXPECT_EQ(count(InputFault::kFrameJump), 1);
  EXPECT_NEAR(border.faults().at(InputFault::kImuJump).value, 1e8, 1.0);
}

TEST_F(InputBorderTest, AStampFarAheadThatStandsAloneIsDropped) {
  border.add(sampleAt(5 * kMs));
  border.add(frameAt(5 * kMs));
  border.add(sampleAt(90 * kSecond));
  border.add(frameAt(90 * kSecond));
  border.add(sampleAt(10 * kMs));
  border.add(frameAt(10 * kMs));
  EXPECT_THAT(passed(), ElementsAre(5, -5, 10, -10));
  EXPECT_EQ(count(InputFault::kImuStampAlone), 1);
  EXPECT_EQ(count(InputFault::kFrameStampAlone), 1);
  EXPECT_EQ(count(InputFault::kImuJump), 0);
}

TEST_F(InputBorderTest, AFirstSampleFarAheadDoesNotBlockWhatComes) {
  border.add(sampleAt(3600 * kSecond));
  border.add(frameAt(6 * kMs));
  for (TimeNs t = 5; t <= 20; t += 5) border.add(sampleAt(t * kMs));
  EXPECT_THAT(passed(), ElementsAre(5, 10, -6, 15, 20));
  EXPECT_EQ(count(InputFault::kImuStampAlone), 1);
  EXPECT_EQ(count(InputFault::kImuFromThePast), 0);
}

TEST_F(InputBorderTest, AFirstFrameFarAheadDoesNotBlockWhatComes) {
  border.add(frameAt(3600 * kSecond));
  border.add(sampleAt(5 * kMs));
  border.add(frameAt(6 * kMs));
  border.add(frameAt(16 * kMs));
  for (TimeNs t = 10; t <= 20; t += 5) border.add(sampleAt(t * kMs));
  EXPECT_THAT(passed(), ElementsAre(5, 10, -6, 15, 20, -16));
  EXPECT_EQ(count(InputFault::kFrameStampAlone), 1);
  EXPECT_EQ(count(InputFault::kFrameFromThePast), 0);
}

TEST_F(InputBorderTest, AClockThatStepsBackIsSaidOnceAndNothingIsIntegratedAcrossIt) {
  border.add(sampleAt(1000 * kMs));
  border.add(frameAt(1002 * kMs));
  for (int k = 0; k < 5; ++k) border.add(frameAt((905 + 10 * k) * kMs));
  for (TimeNs t = 900; t < 1000; t += 5) border.add(sampleAt(t * kMs));
  // The frame that waited for the IMU of before, and the news.
  EXPECT_THAT(passed(), ElementsAre(1000, -1002, 0));
  border.add(frameAt(1004 * kMs));
  border.add(sampleAt(1005 * kMs));  // it has caught up
  EXPECT_THAT(passed(), ElementsAre(1005, -1004));
  EXPECT_EQ(count(InputFault::kImuFromThePast), 20);
  EXPECT_EQ(count(InputFault::kImuStepBack), 1);
  EXPECT_EQ(count(InputFault::kFrameStepBack), 1);
  EXPECT_NEAR(border.faults().at(InputFault::kImuStepBack).value, 0.1, 1e-9);
  EXPECT_EQ(border.faults().at(InputFault::kImuStepBack).first, 900 * kMs);
  EXPECT_NEAR(border.faults().at(InputFault::kFrameStepBack).value, 0.097, 1e-9);
  // The next time it is said again.
  for (TimeNs t = 500; t < 600; t += 5) border.add(sampleAt(t * kMs));
  EXPECT_THAT(passed(), ElementsAre(0));
  EXPECT_EQ(count(InputFault::kImuStepBack), 2);
}

TEST_F(InputBorderTest, MeasurementsThatComeLateAreNoClockThatStepsBack) {
  border.add(sampleAt(1000 * kMs));
  for (TimeNs t = 1005; t < 1100; t += 5) {
    border.add(sampleAt((t - 100) * kMs));  // every one comes again, later
    border.add(sampleAt(t * kMs));
  }
  for (TimeNs t = 1095; t > 1000; t -= 5) border.add(sampleAt(t * kMs));  // in the wrong order
  for (int k = 1; k < InputBorder::kStepBackRun; ++k) border.add(sampleAt((900 + k) * kMs));
  border.add(sampleAt(1100 * kMs));
  EXPECT_EQ(passed().size(), 21U);
  EXPECT_EQ(count(InputFault::kImuStepBack), 0);
  EXPECT_GT(count(InputFault::kImuFromThePast), 30);
}

TEST_F(InputBorderTest, WhatIsHeldPassesAtTheEnd) {
  border.add(sampleAt(5 * kMs));
  border.add(sampleAt(90 * kSecond));
  border.add(frameAt(90 * kSecond));
  border.finish();
  EXPECT_THAT(passed(), ElementsAre(5, 0, 90'000, -90'000));
}

TEST_F(InputBorderTest, SamplesAtTheEndOfTheRangePassMarkedAndAreCounted) {
  for (int i = 0; i < 20; ++i) {
    ImuSample sample = sampleAt((i + 1) * 5 * kMs);
    sample.accel = {0.01 * i, 0.0,
                    i < 10 ? 9.8 : 12.0};  // an axis that is not at its end has noise
    border.add(sample);
  }
  int marked = 0, all = 0;
  while (const auto input = border.next()) {
    ++all;
    marked += std::get<ImuSample>(*input).saturated == saturatedAccel(2);
  }
  EXPECT_EQ(all, 20);
  EXPECT_EQ(marked, 10 - SaturationDetector::kRun + 1);
  EXPECT_EQ(count(InputFault::kImuSaturated), marked);
  EXPECT_EQ(border.faults().at(InputFault::kImuSaturated).value, 12.0);
}

TEST(InputFault, EveryOneHasANameAndASentence) {
  std::vector<std::string> names;
  for (const InputFault fault : inputFaults()) {
    EXPECT_EQ(static_cast<size_t>(fault), names.size());  // in the order of the enumeration
    names.emplace_back(toString(fault));
  }
  EXPECT_EQ(names.size(), static_cast<size_t>(InputFault::kObservationBroken) + 1);
  EXPECT_EQ(
      describe(InputFault::kImuTooLarge, {2, 17, 1e30}),
      "input: 2 IMU samples dropped: beyond [input] max_gyro_rps or max_accel_mps2 (the first "
      "at stamp 17: 1e+30)");
  EXPECT_THAT(describe(InputFault::kFrameUnusable, {1, 17, 0}),
              HasSubstr("1 stereo frame dropped"));
}

}  // namespace
}  // namespace etalon
