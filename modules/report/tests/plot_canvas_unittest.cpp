// Lines, letters and axes of the plots: where they land, in pixels.

#include "plot_canvas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

const Color kBlack(0, 0, 0);

/** The picture as it is written. */
cv::Mat pictureOf(const PlotCanvas& canvas) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "picture.png";
  canvas.write(path);
  return cv::imread(path, cv::IMREAD_GRAYSCALE);
}

/** The smallest box around the pixels darker than half; empty if there are none. */
cv::Rect darkBox(const cv::Mat& picture) {
  int x0 = picture.cols, x1 = -1, y0 = picture.rows, y1 = -1;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      if (picture.at<uchar>(y, x) < 128) {
        x0 = std::min(x0, x);
        x1 = std::max(x1, x);
        y0 = std::min(y0, y);
        y1 = std::max(y1, y);
      }
  return x1 < 0 ? cv::Rect() : cv::Rect(x0, y0, x1 - x0 + 1, y1 - y0 + 1);
}

template <typename Draw>
cv::Rect drawn(const Draw& draw) {
  PlotCanvas canvas(200, 100);
  draw(&canvas);
  const cv::Mat picture = pictureOf(canvas);
  EXPECT_EQ(picture.size(), cv::Size(200, 100));
  return darkBox(picture);
}

/** The same to a pixel on every side. */
void expectNear(const cv::Rect& box, const cv::Rect& expected) {
  EXPECT_NEAR(box.x, expected.x, 1) << box;
  EXPECT_NEAR(box.y, expected.y, 1) << box;
  EXPECT_NEAR(box.x + box.width, expected.x + expected.width, 1) << box;
  EXPECT_NEAR(box.y + box.height, expected.y + expected.height, 1) << box;
}

TEST(PlotCanvas, IsWhiteToBeginWith) {
  const cv::Mat picture = pictureOf(PlotCanvas(30, 20));
  EXPECT_EQ(cv::countNonZero(picture == 255), 600);
}

TEST(PlotCanvas, ShapesAreWhereTheyAreDrawn) {
  expectNear(drawn([](PlotCanvas* c) {
               c->line({20, 30}, {120, 30}, kBlack, 4.0);
             }),
             {18, 28, 104, 4});
  expectNear(drawn([](PlotCanvas* c) { c->fill({50, 10, 60, 40}, kBlack); }), {50, 10, 60, 40});
  expectNear(drawn([](PlotCanvas* c) {
               c->frame({50, 10, 60, 40}, kBlack, 2.0);
             }),
             {49, 9, 62, 42});
  expectNear(drawn([](PlotCanvas* c) { c->disc({100, 50}, 12.0, kBlack); }), {88, 38, 24, 24});
  expectNear(drawn([](PlotCanvas* c) { c->diamond({100, 50}, 12.0, kBlack); }), {89, 39, 22, 22});
  expectNear(drawn([](PlotCanvas* c) {
               c->polyline({{20, 20}, {60, 80}, {140, 20}}, kBlack, 3.0);
             }),
             {19, 19, 122, 62});
  EXPECT_TRUE(drawn([](PlotCanvas* c) { c->polyline({}, kBlack, 3.0); }).empty());
}

TEST(PlotCanvas, AFrameIsHollowAndALineMayLeaveThePicture) {
  PlotCanvas canvas(200, 100);
  canvas.frame({50, 10, 60, 40}, kBlack, 2.0);
  EXPECT_EQ(pictureOf(canvas).at<uchar>(30, 80), 255);
  EXPECT_EQ(drawn([](PlotCanvas* c) { c->line({-500, 50}, {900, 50}, kBlack, 2.0); }).width, 200);
}

TEST(PlotCanvas, ADashedLineHasGapsAndEndsWhereItShould) {
  PlotCanvas canvas(200, 100);
  canvas.dashedLine({20, 50}, {120, 50}, kBlack, 2.0);
  const cv::Mat row = pictureOf(canvas).row(50);
  int changes = 0;
  for (int x = 1; x < row.cols; ++x)
    changes += (row.at<uchar>(0, x) < 128) != (row.at<uchar>(0, x - 1) < 128);
  EXPECT_EQ(changes, 20);  // ten dashes of 6 with gaps of 4
  EXPECT_LE(darkBox(row).x + darkBox(row).width, 122);
  PlotCanvas empty(200, 100);
  empty.dashedLine({20, 50}, {20, 50}, kBlack, 2.0);  // of no length
  EXPECT_TRUE(darkBox(pictureOf(empty)).empty());
}

TEST(PlotCanvas, LettersStandOnTheirLineAndAreAlignedAsAsked) {
  const auto box = [](TextAlign align) {
    return drawn([align](PlotCanvas* c) { c->text({100, 60}, "HHHH", 14.0, kBlack, align); });
  };
  const double width = PlotCanvas::textWidth("HHHH", 14.0);
  const cv::Rect left = box(TextAlign::kLeft), centre = box(TextAlign::kCentre),
                 right = box(TextAlign::kRight);
  EXPECT_NEAR(left.height, 14, 3);
  EXPECT_NEAR(left.y + left.height, 60, 2);
  EXPECT_NEAR(left.x, 101, 3);
  EXPECT_NEAR(left.x - centre.x, 0.5 * width, 1.5);
  EXPECT_NEAR(left.x - right.x, width, 1.5);
  EXPECT_LE(right.x + right.width, 101);
  EXPECT_NEAR(PlotCanvas::textWidth("HHHHHHHH", 14.0), 2.0 * width, 0.05 * width);
  EXPECT_NEAR(PlotCanvas::textWidth("HHHH", 28.0), 2.0 * width, 0.05 * width);
}

TEST(PlotCanvas, VerticalTextReadsUpwardsAndMayBeCutByTheEdge) {
  const cv::Rect box = drawn([](PlotCanvas* c) {
    c->verticalText({100, 50}, "HHHH", 14.0, kBlack);
  });
  EXPECT_GT(box.height, 2 * box.width);
  EXPECT_NEAR(box.y + 0.5 * box.height, 50.0, 2.0);
  EXPECT_NEAR(box.height, PlotCanvas::textWidth("HHHH", 14.0), 5.0);
  EXPECT_FALSE(drawn([](PlotCanvas* c) {
                 c->verticalText({2, 50}, "HHHH", 14.0, kBlack);
               }).empty());
  EXPECT_TRUE(drawn([](PlotCanvas* c) {
                c->verticalText({-90, 50}, "HHHH", 14.0, kBlack);
              }).empty());
}

TEST(PlotCanvas, OnlyPicturesAreWritten) {
  const testing::TemporaryFolder folder;
  const PlotCanvas canvas(10, 10);
  EXPECT_THROW(canvas.write(folder / "picture.txt"), DataError);
  EXPECT_THROW(canvas.write(folder / "no/such/folder/picture.png"), DataError);
}

TEST(PlotArea, MapsItsCornersAndTurnsYUp) {
  const PlotArea area({10, 20, 100, 50}, -1.0, 3.0, 100.0, 200.0);
  EXPECT_EQ(area.at(-1.0, 100.0), cv::Point2d(10, 70));
  EXPECT_EQ(area.at(3.0, 200.0), cv::Point2d(110, 20));
  EXPECT_EQ(area.at(0.0, 150.0), cv::Point2d(35, 45));
}

TEST(Ticks, AreRoundInStepAndLabel) {
  for (const double scale : {1e-6, 1e-3, 1.0, 1e4}) {
    for (const double width : {1.0, 1.7, 2.4, 3.9, 6.1, 9.9}) {
      const Ticks ticks(0.13 * scale, (0.13 + width) * scale, 5);
      const double digits = ticks.step / std::pow(10.0, std::floor(std::log10(ticks.step) + 1e-9));
      EXPECT_LT(std::min({std::abs(digits - 1), std::abs(digits - 2), std::abs(digits - 5)}), 1e-9);
      EXPECT_GE(ticks.count, 2);
      EXPECT_LE(ticks.count, 6);
      // A label, read back, gives the value.
      for (int i = 0; i < ticks.count; ++i)
        EXPECT_NEAR(std::stod(ticks.label(i)), ticks.value(i), 1e-6 * ticks.step);
      // The next tick on either side would be outside.
      EXPECT_LT(ticks.value(-1), 0.13 * scale);
      EXPECT_GT(ticks.value(ticks.count), (0.13 + width) * scale);
    }
  }
}

TEST(Ticks, ZeroHasNoSignAndNothingHasNoTicks) {
  const Ticks ticks(-0.3, 0.3, 6);
  for (int i = 0; i < ticks.count; ++i)
    if (std::abs(ticks.value(i)) < 1e-6) {
      EXPECT_EQ(ticks.label(i), "0.0");
    }
  EXPECT_EQ(Ticks(NAN, 1.0, 5).count, 0);
  EXPECT_EQ(Ticks(0.0, INFINITY, 5).count, 0);
  EXPECT_EQ(Ticks(2.0, 2.0, 5).count, 1);  // one value: itself
  EXPECT_EQ(Ticks(2.0, 2.0, 5).value(0), 2.0);
}

TEST(PlotCanvas, WritesTheSameAsSvg) {
  PlotCanvas canvas(200, 100);
  canvas.line({20, 30}, {120, 30}, Color(255, 0, 0), 4.0);
  canvas.fill({50, 10, 60, 40}, kBlack);
  canvas.frame({50, 10, 60, 40}, kBlack, 2.0);
  canvas.disc({100, 50}, 12.0, kBlack);
  canvas.diamond({100, 50}, 12.0, kBlack);
  canvas.text({10, 20}, "a < b & c", 10.0, kBlack, TextAlign::kRight);
  canvas.verticalText({30, 50}, "up", 10.0, kBlack);
  const testing::TemporaryFolder folder;
  canvas.write(folder / "picture.svg");
  std::ifstream file(folder / "picture.svg");
  const std::string svg((std::istreambuf_iterator<char>(file)), {});
  for (const char* element :
       {"width=\"200\" height=\"100\"",
        "<polyline points=\"20.0,30.0 120.0,30.0 \" fill=\"none\" stroke=\"#0000ff\"",
        "<polygon points=\"50.0,10.0 110.0,10.0 110.0,50.0 50.0,50.0 \" fill=\"#000000\"",
        "<circle cx=\"100.0\" cy=\"50.0\" r=\"12.0\"",
        "<polygon points=\"88.0,50.0 100.0,38.0 112.0,50.0 100.0,62.0 \"",
        "text-anchor=\"end\" fill=\"#000000\">a &lt; b &amp; c</text>", "rotate(-90 30.0 50.0)"})
    EXPECT_NE(svg.find(element), std::string::npos) << element << "\n" << svg;
}

TEST(PlotCanvas, RefusesAFileOfAnotherKind) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(PlotCanvas(20, 10).write(folder / "picture.xyz"), DataError);
  EXPECT_THROW(PlotCanvas(20, 10).write(folder / "no/such.svg"), DataError);
}

}  // namespace
}  // namespace etalon
