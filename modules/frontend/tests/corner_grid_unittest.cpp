// New corners: one a cell, the strongest first, none beside a landmark.

#include "corner_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace etalon {
namespace {

const cv::Size kSize(400, 300);

StereoTrackerOptions options() {
  StereoTrackerOptions o;
  o.max_features = 12;  // four columns and three rows of 100 px
  o.min_distance_px = 20;
  o.border_px = 10;
  return o;
}

/** Bright squares with a corner at each pixel; the contrast is 40, then 60, 80, ... */
cv::Mat squaresAt(const std::vector<cv::Point>& corners) {
  cv::Mat image(kSize, CV_8UC1, cv::Scalar(20));
  int contrast = 40;
  for (const cv::Point& corner : corners) {
    image(cv::Rect(corner, cv::Size(12, 12)) & cv::Rect({0, 0}, kSize)).setTo(20 + contrast);
    contrast += 20;
  }
  return image;
}

TEST(CornerGrid, GivesEveryCellItsStrongestCornerStrongestFirst) {
  const StereoTrackerOptions o = options();
  CornerGrid grid(kSize, o);
  // Two in the first cell, one in another; each square has four corners.
  const cv::Mat image = squaresAt({{30, 30}, {330, 230}, {60, 60}});
  const auto corners = grid.detect(image, 100);
  ASSERT_EQ(corners.size(), 2U);
  const auto isAt = [](const cv::Point2f& p, const cv::Point& square) {
    return p.x > square.x - 5 && p.x < square.x + 17 && p.y > square.y - 5 && p.y < square.y + 17;
  };
  EXPECT_TRUE(isAt(corners[0], {60, 60})) << corners[0];  // contrast 80
  EXPECT_TRUE(isAt(corners[1], {330, 230})) << corners[1];
  // Their cells are taken now: the weaker one of the first is not wanted any more.
  EXPECT_TRUE(grid.detect(image, 100).empty());
}

TEST(CornerGrid, TheStrongestIsTheOneOfOpenCv) {
  cv::Mat image(kSize, CV_8UC1);
  cv::theRNG().state = 1;
  cv::randu(image, 0, 255);
  cv::GaussianBlur(image, image, {9, 9}, 2.0);
  StereoTrackerOptions o = options();
  o.max_features = 1;
  cv::Mat response;
  cv::cornerMinEigenVal(image, response, 5, 3);
  const cv::Rect inner(o.border_px, o.border_px, kSize.width - 2 * o.border_px,
                       kSize.height - 2 * o.border_px);
  double strongest = 0.0;
  cv::Point at;
  cv::minMaxLoc(response(inner), nullptr, &strongest, nullptr, &at);
  // The threshold is in the same scale, too.
  o.min_corner_response = 0.9999 * strongest;
  const auto corners = CornerGrid(kSize, o).detect(image, 1);
  ASSERT_EQ(corners.size(), 1U);
  EXPECT_EQ(cv::Point(corners[0]), at + inner.tl());
  o.min_corner_response = 1.0001 * strongest;
  EXPECT_TRUE(CornerGrid(kSize, o).detect(image, 1).empty());
}

TEST(CornerGrid, NoMoreThanAreWanted) {
  const StereoTrackerOptions o = options();
  const cv::Mat image = squaresAt({{30, 30}, {130, 30}, {230, 30}, {330, 30}});
  EXPECT_EQ(CornerGrid(kSize, o).detect(image, 3).size(), 3U);
  EXPECT_TRUE(CornerGrid(kSize, o).detect(image, 0).empty());
  // The strongest is the last.
  EXPECT_GT(CornerGrid(kSize, o).detect(image, 1)[0].x, 300.0F);
}

TEST(CornerGrid, ALandmarkTakesItsCellAndKeepsOthersAway) {
  const StereoTrackerOptions o = options();
  CornerGrid grid(kSize, o);
  EXPECT_TRUE(grid.claim({150.0F, 150.0F}));
  EXPECT_FALSE(grid.claim({150.0F, 169.0F}));  // 19 px
  EXPECT_TRUE(grid.claim({150.0F, 171.5F}));
  EXPECT_TRUE(grid.detect(squaresAt({{120, 120}}), 10).empty());  // its cell
  // Beside a landmark, across the border of the cells.
  CornerGrid other(kSize, o);
  EXPECT_TRUE(other.claim({98.0F, 50.0F}));
  for (const cv::Point2f& corner : other.detect(squaresAt({{103, 45}}), 10))
    EXPECT_GE(std::hypot(corner.x - 98.0F, corner.y - 50.0F), 19.0F);
}

TEST(CornerGrid, TheBorderAndWhatIsOutsideAreNobodys) {
  const StereoTrackerOptions o = options();
  CornerGrid grid(kSize, o);
  EXPECT_FALSE(grid.claim({9.0F, 150.0F}));
  EXPECT_TRUE(grid.claim({10.0F, 150.0F}));
  EXPECT_FALSE(grid.claim({390.0F, 50.0F}));
  EXPECT_TRUE(grid.claim({389.0F, 50.0F}));
  EXPECT_FALSE(grid.claim({-5.0F, 50.0F}));
  EXPECT_FALSE(grid.claim({1000.0F, 50.0F}));
  for (const cv::Point2f& p : CornerGrid(kSize, o).detect(squaresAt({{2, 2}, {385, 280}}), 10))
    EXPECT_TRUE(p.x >= 10 && p.x < 390 && p.y >= 10 && p.y < 290) << p;
}

TEST(CornerGrid, WeakCornersAreNone) {
  StereoTrackerOptions o = options();
  const cv::Mat flat(kSize, CV_8UC1, cv::Scalar(80));
  EXPECT_TRUE(CornerGrid(kSize, o).detect(flat, 10).empty());
  const cv::Mat image = squaresAt({{30, 30}});
  EXPECT_EQ(CornerGrid(kSize, o).detect(image, 10).size(), 1U);
  o.min_corner_response = 1e9;
  EXPECT_TRUE(CornerGrid(kSize, o).detect(image, 10).empty());
}

}  // namespace
}  // namespace etalon
