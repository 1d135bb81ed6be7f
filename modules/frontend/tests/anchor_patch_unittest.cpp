// A patch against images that show it moved, turned, brighter, or not at all.

#include "etalon/frontend/anchor_patch.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace etalon {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kWidth = 160, kHeight = 120, kSide = 21;

/** Waves of 9 to 20 px: a smooth scene without end. */
double scene(const Vector2d& x) {
  return 128.0 + 40.0 * std::sin(0.55 * x.x() + 0.31 * x.y()) +
         35.0 * std::sin(0.37 * x.y() - 0.52 * x.x() + 1.0) + 25.0 * std::sin(0.7 * x.y() + 0.5);
}

/** What stands at A^-1 (x - t) of the scene, with a gain and an offset of the gray levels. */
cv::Mat imageOf(const Matrix2d& A, const Vector2d& t, double gain = 1.0, double offset = 0.0) {
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  const Matrix2d inverse = A.inverse();
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(
          gain * (scene(inverse * (Vector2d(u, v) - t)) - 128.0) + 128.0 + offset);
  return image;
}

const Vector2d kCentre(80.3, 60.7);

/** Where the patch ends from a guess that is off by `error` px. */
struct Aligned {
  PatchPose pose;
  double correlation = 0.0;
};
Aligned align(const cv::Mat& image, const Vector2d& guess, int iterations = 30) {
  const AnchorPatch patch(imageOf(Matrix2d::Identity(), Vector2d::Zero()), kCentre, kSide);
  EXPECT_TRUE(patch.valid());
  Aligned result;
  result.pose.centre = guess;
  result.correlation = patch.align(image, &result.pose, iterations, 0.01);
  return result;
}

TEST(AnchorPatch, OnItsOwnImageItStaysWhereItIs) {
  const Aligned same = align(imageOf(Matrix2d::Identity(), Vector2d::Zero()), kCentre);
  EXPECT_LT((same.pose.centre - kCentre).norm(), 1e-3);
  EXPECT_LT((same.pose.A - Matrix2d::Identity()).norm(), 1e-3);
  EXPECT_NEAR(same.correlation, 1.0, 1e-4);
}

TEST(AnchorPatch, FindsShiftAndAffineWarpToAHundredthOfAPixel) {
  const Matrix2d A = (Matrix2d() << 1.08, -0.1, 0.07, 0.95).finished();
  const Vector2d t(4.0, -7.5);
  const Vector2d truth = A * kCentre + t;
  const Aligned found = align(imageOf(A, t), truth + Vector2d(1.3, -0.9));
  // Interpolation and rounding of gray levels.
  EXPECT_LT((found.pose.centre - truth).norm(), 0.02);
  EXPECT_LT((found.pose.A - A).norm(), 0.01);
  EXPECT_GT(found.correlation, 0.999);
}

TEST(AnchorPatch, GainAndOffsetOfTheGrayLevelsDoNotMatter) {
  const Vector2d t(2.25, 1.5);
  for (const auto& [gain, offset] : {std::pair(0.4, 0.0), {0.6, 40.0}, {1.0, -20.0}}) {
    const Aligned found =
        align(imageOf(Matrix2d::Identity(), t, gain, offset), kCentre + t + Vector2d(1, 1));
    EXPECT_LT((found.pose.centre - kCentre - t).norm(), 0.03) << gain;
    EXPECT_GT(found.correlation, 0.998) << gain;
  }
}

TEST(AnchorPatch, WhatIsNotThereIsNotFound) {
  // The negative of the scene, and no scene at all.
  EXPECT_LT(align(imageOf(Matrix2d::Identity(), Vector2d::Zero(), -1.0), kCentre).correlation, 0.5);
  EXPECT_LT(align(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(128)), kCentre).correlation, 0.0);
  // One step is not enough where the guess is off.
  EXPECT_LT(align(imageOf(Matrix2d::Identity(), Vector2d::Zero()), kCentre + Vector2d(1.5, 1.0), 1)
                .correlation,
            0.0);
}

TEST(AnchorPatch, APatchThatLeavesTheImageIsNone) {
  const cv::Mat image = imageOf(Matrix2d::Identity(), Vector2d::Zero());
  // Ten pixels on every side, and one more for the derivatives; the last column is for
  // interpolation.
  EXPECT_TRUE(AnchorPatch(image, {11.1, 60.0}, kSide).valid());
  EXPECT_FALSE(AnchorPatch(image, {10.9, 60.0}, kSide).valid());
  EXPECT_TRUE(AnchorPatch(image, {147.9, 60.0}, kSide).valid());
  EXPECT_FALSE(AnchorPatch(image, {148.1, 60.0}, kSide).valid());
  EXPECT_FALSE(AnchorPatch(image, {60.0, 108.1}, kSide).valid());
  EXPECT_FALSE(AnchorPatch(image, {NAN, 60.0}, kSide).valid());
  EXPECT_LT(align(image, {5.0, 60.0}).correlation, 0.0);
  EXPECT_LT(align(image, {NAN, NAN}).correlation, 0.0);
}

TEST(AnchorPatch, WithoutTextureItIsInvalidAndAlignsWithNothing) {
  const cv::Mat flat(kHeight, kWidth, CV_8UC1, cv::Scalar(90));
  const AnchorPatch patch(flat, kCentre, kSide);
  EXPECT_FALSE(patch.valid());
  PatchPose pose{kCentre, Matrix2d::Identity()};
  EXPECT_LT(patch.align(flat, &pose, 10, 0.01), 0.0);
  EXPECT_FALSE(AnchorPatch().valid());
  // Stripes do not tell where along them it is.
  cv::Mat stripes(kHeight, kWidth, CV_8UC1);
  for (int u = 0; u < kWidth; ++u)
    stripes.col(u).setTo(cv::Scalar(128.0 + 100.0 * std::sin(0.5 * u)));
  EXPECT_FALSE(AnchorPatch(stripes, kCentre, kSide).valid());
}

}  // namespace
}  // namespace etalon
