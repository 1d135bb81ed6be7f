#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "bags/bag_file.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

/** Two rows of two pixels, with a byte of padding behind each row. */
BagImage image(const std::string& encoding, std::uint32_t bytes_a_row,
               std::vector<std::uint8_t> data) {
  BagImage result;
  result.encoding = encoding;
  result.width = result.height = 2;
  result.step = bytes_a_row;
  result.data = std::move(data);
  return result;
}

std::vector<int> pixelsOf(const BagImage& image) {
  std::string problem;
  const cv::Mat gray = toGray(image, &problem);
  EXPECT_EQ(problem, "");
  std::vector<int> pixels;
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x) pixels.push_back(gray.at<std::uint8_t>(y, x));
  return pixels;
}

std::string problemOf(const BagImage& image) {
  std::string problem;
  EXPECT_TRUE(toGray(image, &problem).empty());
  return problem;
}

TEST(BagImage, GrayHasPaddingBehindItsRows) {
  EXPECT_EQ(pixelsOf(image("mono8", 3, {1, 2, 99, 3, 4, 99})), (std::vector<int>{1, 2, 3, 4}));
}

TEST(BagImage, OfSixteenBitsTheUpperEightAreKept) {
  const std::vector<std::uint8_t> data = {255, 1, 0, 2, 255, 3, 0, 4};
  BagImage wide = image("mono16", 4, data);
  EXPECT_EQ(pixelsOf(wide), (std::vector<int>{1, 2, 3, 4}));
  wide.big_endian = true;
  EXPECT_EQ(pixelsOf(wide), (std::vector<int>{255, 0, 255, 0}));
}

TEST(BagImage, ColoursBecomeGray) {
  // Red weighs 0.299, blue 0.114 (ITU-R BT.601, as OpenCV has it).
  const std::vector<std::uint8_t> data = {100, 0, 0, 100, 0, 0, 100, 0, 0, 100, 0, 0};
  EXPECT_EQ(pixelsOf(image("rgb8", 6, data)), std::vector<int>(4, 30));
  EXPECT_EQ(pixelsOf(image("bgr8", 6, data)), std::vector<int>(4, 11));
}

TEST(BagImage, CompressedIsDecoded) {
  const cv::Mat gray = (cv::Mat_<std::uint8_t>(2, 2) << 9, 8, 7, 6);
  BagImage compressed;
  compressed.compressed = true;
  compressed.encoding = "png";
  ASSERT_TRUE(cv::imencode(".png", gray, compressed.data));
  EXPECT_EQ(pixelsOf(compressed), (std::vector<int>{9, 8, 7, 6}));
  std::vector<std::uint8_t> start(compressed.data.begin(), compressed.data.end() - 20);
  std::swap(start, compressed.data);
  EXPECT_THAT(problemOf(compressed), HasSubstr("('png'): the PNG file is truncated"));
  compressed.data = {1, 2, 3};
  EXPECT_THAT(problemOf(compressed), HasSubstr("('png'): the file cannot be decoded"));
  compressed.data.clear();
  EXPECT_THAT(problemOf(compressed), HasSubstr("the image file is empty"));
}

TEST(BagImage, WhatDoesNotFitIsRefused) {
  EXPECT_THAT(problemOf(image("bayer_rggb8", 2, {1, 2, 3, 4})),
              HasSubstr("'bayer_rggb8' is not read; expected one of mono8"));
  EXPECT_THAT(problemOf(image("mono8", 2, {1, 2, 3})), HasSubstr("holds 3 bytes; expected 2 rows"));
  EXPECT_THAT(problemOf(image("mono16", 2, {1, 2, 3, 4})), HasSubstr("expected 2 rows"));
  BagImage huge = image("mono8", 0xffffffff, {1, 2, 3, 4});
  EXPECT_THAT(problemOf(huge), HasSubstr("expected 2 rows"));
  huge.width = huge.height = huge.step = 0;
  EXPECT_THAT(problemOf(huge), HasSubstr("expected 0 rows"));
}

}  // namespace
}  // namespace etalon
