#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace etalon {

/** Blue, green, red, 0 to 255. */
using Color = cv::Scalar;

enum class TextAlign { kLeft, kCentre, kRight };

/**
 * A white picture to draw on, in pixels from the top left corner. Drawn at three times its size and
 * averaged down, which smooths lines and letters alike; and as SVG beside it.
 */
class PlotCanvas {
 public:
  PlotCanvas(int width, int height);

  void line(cv::Point2d a, cv::Point2d b, const Color& color, double width = 1.0);
  void dashedLine(cv::Point2d a, cv::Point2d b, const Color& color, double width = 1.0);
  void polyline(const std::vector<cv::Point2d>& points, const Color& color, double width = 1.0,
                bool dashed = false);
  void disc(cv::Point2d centre, double radius, const Color& color);
  void diamond(cv::Point2d centre, double radius, const Color& color);
  void frame(const cv::Rect2d& box, const Color& color, double width = 1.0);
  void fill(const cv::Rect2d& box, const Color& color);

  /** Draws ASCII text of `size` px (height of a capital letter) with its base line at `at`. */
  void text(cv::Point2d at, const std::string& text, double size, const Color& color,
            TextAlign align = TextAlign::kLeft);
  /** Draws text that reads upwards, centred on `at`. */
  void verticalText(cv::Point2d at, const std::string& text, double size, const Color& color);
  /** Width of a text, px. */
  static double textWidth(const std::string& text, double size);

  /** Writes a .png or .svg file. @throws DataError if it cannot be written. */
  void write(const std::string& path) const;
  /** The text of an <svg> element. */
  std::string svg() const;

 private:
  void writePng(const std::string& path) const;
  void shape(const char* kind, const std::vector<cv::Point2d>& points, const std::string& style);
  void letters(cv::Point2d at, const std::string& text, double size, const Color& color,
               const char* anchor, const std::string& turn);

  cv::Mat image_;
  std::string svg_;  ///< the elements
};

/** Round values between `low` and `high`, at distances of 1, 2 or 5 times a power of ten. */
struct Ticks {
  double first = 0.0, step = 1.0;
  int count = 0, decimals = 0;

  Ticks(double low, double high, int at_most);
  double value(int i) const;
  std::string label(int i) const;
};

/** A box with a coordinate system. */
class PlotArea {
 public:
  PlotArea(const cv::Rect2d& box, double x_low, double x_high, double y_low, double y_high)
      : box_(box), x_low_(x_low), x_high_(x_high), y_low_(y_low), y_high_(y_high) {}

  const cv::Rect2d& box() const { return box_; }
  cv::Point2d at(double x, double y) const {
    return {box_.x + (x - x_low_) / (x_high_ - x_low_) * box_.width,
            box_.y + box_.height - (y - y_low_) / (y_high_ - y_low_) * box_.height};
  }
  /** Draws grid, frame, ticks with numbers and labels of the axes. */
  void drawAxes(PlotCanvas* canvas, const std::string& x_label, const std::string& y_label,
                int x_ticks, int y_ticks) const;

 private:
  cv::Rect2d box_;
  double x_low_, x_high_, y_low_, y_high_;
};

}  // namespace etalon
