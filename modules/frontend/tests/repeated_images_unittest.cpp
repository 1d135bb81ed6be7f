#include "etalon/frontend/repeated_images.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

using Repeated = std::array<bool, 2>;
constexpr Repeated kNone{false, false}, kLeft{true, false}, kRight{false, true}, kBoth{true, true};

cv::Mat imageOf(int seed) {
  cv::Mat image(48, 64, CV_8UC1);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<uchar>(y, x) = static_cast<uchar>((x * 7 + y * 13 + seed * 31) % 251);
  return image;
}

std::vector<ImuSample> imuOf(double rate_rps, double push_mps2 = 0.0) {
  std::vector<ImuSample> samples(10);
  for (ImuSample& sample : samples) {
    sample.gyro = {rate_rps, 0.02, 0.07};  // with a bias
    sample.accel = {push_mps2, 0.0, 9.81};
  }
  return samples;
}

TrackedFrame tracksAt(double x) {
  TrackedFrame frame;
  for (int id = 0; id < 20; ++id) {
    Observation o;
    o.id = id;
    o.left = {x + id, 10.0};
    frame.observations.push_back(o);
  }
  return frame;
}

/** Two new frames whose tracks move by `flow_px`. */
RepeatedImages afterTwoFrames(double flow_px) {
  RepeatedImages repeated;
  EXPECT_EQ(kNone, repeated.areRepeated(imageOf(0), imageOf(1), {}));
  repeated.tracked(tracksAt(0.0));
  EXPECT_EQ(kNone, repeated.areRepeated(imageOf(2), imageOf(3), imuOf(0.0)));
  repeated.tracked(tracksAt(flow_px));
  return repeated;
}

TEST(RepeatedImages, AtRestTheSameImageIsBelieved) {
  RepeatedImages repeated = afterTwoFrames(0.1);
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(kNone, repeated.areRepeated(imageOf(2), imageOf(3), imuOf(k % 2 * 1e-3)));
    repeated.tracked(tracksAt(0.1));
  }
}

TEST(RepeatedImages, TracksInAnImageThatRepeatsTheOneBeforeAreNoMotion) {
  RepeatedImages repeated = afterTwoFrames(0.1);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(kNone, repeated.areRepeated(imageOf(2), imageOf(3), imuOf(0.0)));
    repeated.tracked(tracksAt(1.0 + k));
  }
}

TEST(RepeatedImages, InMotionItIsNotAndUntilANewOneComes) {
  RepeatedImages repeated = afterTwoFrames(3.0);
  for (int k = 0; k < 3; ++k)
    EXPECT_EQ(kBoth, repeated.areRepeated(imageOf(2), imageOf(3), imuOf(0.0)));
  EXPECT_EQ(kNone, repeated.areRepeated(imageOf(4), imageOf(5), imuOf(0.0)));
}

TEST(RepeatedImages, ACameraThatHangsLeavesTheOther) {
  RepeatedImages repeated = afterTwoFrames(3.0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(kLeft, repeated.areRepeated(imageOf(2), imageOf(5 + 2 * k), {}));
    repeated.tracked(tracksAt(3.0));
  }
  EXPECT_EQ(kNone, repeated.areRepeated(imageOf(20), imageOf(21), {}));
  EXPECT_EQ(kRight, afterTwoFrames(3.0).areRepeated(imageOf(4), imageOf(3), {}));
}

TEST(RepeatedImages, WhatStartsToMoveWhileTheCameraHangsIsRecognised) {
  RepeatedImages turned = afterTwoFrames(0.1), pushed = afterTwoFrames(0.1);
  EXPECT_EQ(kNone, turned.areRepeated(imageOf(2), imageOf(3), imuOf(0.01)));
  EXPECT_EQ(kBoth, turned.areRepeated(imageOf(2), imageOf(3), imuOf(0.1)));
  EXPECT_EQ(kBoth, turned.areRepeated(imageOf(2), imageOf(3), imuOf(0.0)));  // it has moved since
  EXPECT_EQ(kNone, pushed.areRepeated(imageOf(2), imageOf(3), imuOf(0.0, 0.1)));
  EXPECT_EQ(kBoth, pushed.areRepeated(imageOf(2), imageOf(3), imuOf(0.0, 0.8)));
}

TEST(RepeatedImages, ACallerMayUseItsBufferAgain) {
  RepeatedImages repeated = afterTwoFrames(3.0);
  cv::Mat left = imageOf(6), right = imageOf(7);
  EXPECT_EQ(kNone, repeated.areRepeated(left, right, {}));
  imageOf(8).copyTo(left);
  imageOf(9).copyTo(right);
  EXPECT_EQ(kNone, repeated.areRepeated(left, right, {}));
}

TEST(RepeatedImages, ACoveredLensRepeatsNothing) {
  RepeatedImages repeated = afterTwoFrames(5.0);
  const cv::Mat dark(48, 64, CV_8UC1, cv::Scalar(3));
  for (int frame = 0; frame < 3; ++frame)
    EXPECT_EQ(kNone, repeated.areRepeated(dark, imageOf(10 + frame), imuOf(0.1 * frame)));
}

}  // namespace
}  // namespace etalon
