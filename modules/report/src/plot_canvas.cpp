#include "plot_canvas.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

constexpr int kOversampling = 3;
constexpr int kShift = 4;  // fractional bits of OpenCV's coordinates
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontCapitalHeight = 21.0;  // of that font at scale 1, px

const Color kGrid(232, 232, 232);
const Color kAxis(90, 90, 90);
const Color kLabel(50, 50, 50);
constexpr double kTickTextSize = 9.0;
constexpr double kLabelTextSize = 10.0;

cv::Point toFixed(cv::Point2d p) {
  constexpr double kUnit = kOversampling * (1 << kShift);
  return {static_cast<int>(std::lround(p.x * kUnit)), static_cast<int>(std::lround(p.y * kUnit))};
}

int toThickness(double width) {
  return std::max(1, static_cast<int>(std::lround(width * kOversampling)));
}

double fontScale(double size) { return size * kOversampling / kFontCapitalHeight; }

/** Strokes of a tenth of the letters' height. */
int strokeWidth(double size) { return toThickness(0.11 * size); }

/** A colour of SVG, e.g. "#1469b4". */
std::string hex(const Color& color) {
  return format("#%02x%02x%02x", static_cast<int>(color[2]), static_cast<int>(color[1]),
                static_cast<int>(color[0]));
}

std::string stroke(const Color& color, double width) {
  return format("fill=\"none\" stroke=\"%s\" stroke-width=\"%.2f\"", hex(color).c_str(), width);
}

constexpr double kDash = 6.0, kGap = 4.0;  // px

/** The pieces of a dashed line, which goes on around its corners. */
std::vector<std::vector<cv::Point2d>> dashesOf(const std::vector<cv::Point2d>& points) {
  std::vector<std::vector<cv::Point2d>> dashes;
  double phase = 0.0;  // since the beginning of the last dash
  for (size_t i = 1; i < points.size(); ++i) {
    const cv::Point2d a = points[i - 1], b = points[i];
    const double length = cv::norm(b - a);
    for (double s = 0.0; s < length;) {
      const bool drawn = phase < kDash;
      const double step = std::min(length - s, (drawn ? kDash : kDash + kGap) - phase);
      if (phase == 0.0) dashes.push_back({a + (b - a) * (s / length)});
      s += step;
      if (drawn) dashes.back().push_back(a + (b - a) * (s / length));
      phase += step;
      if (phase >= kDash + kGap) phase = 0.0;
    }
  }
  return dashes;
}

std::string filled(const Color& color) { return "fill=\"" + hex(color) + "\""; }

std::vector<cv::Point2d> cornersOf(const cv::Rect2d& box) {
  return {box.tl(), {box.x + box.width, box.y}, box.br(), {box.x, box.y + box.height}};
}

}  // namespace

void PlotCanvas::shape(const char* kind, const std::vector<cv::Point2d>& points,
                       const std::string& style) {
  svg_ += std::string("<") + kind + " points=\"";
  for (const cv::Point2d& p : points) svg_ += format("%.1f,%.1f ", p.x, p.y);
  svg_ += "\" " + style + "/>\n";
}

void PlotCanvas::letters(cv::Point2d at, const std::string& text, double size, const Color& color,
                         const char* anchor, const std::string& turn) {
  constexpr double kCapitalHeight = 0.72;  // of a sans-serif font's size
  svg_ += format("<text x=\"%.1f\" y=\"%.1f\" font-size=\"%.1f\" text-anchor=\"%s\"%s ", at.x, at.y,
                 size / kCapitalHeight, anchor, turn.c_str());
  svg_ += filled(color) + ">" + htmlText(text) + "</text>\n";
}

PlotCanvas::PlotCanvas(int width, int height)
    : image_(height * kOversampling, width * kOversampling, CV_8UC3, cv::Scalar::all(255)) {}

void PlotCanvas::line(cv::Point2d a, cv::Point2d b, const Color& color, double width) {
  cv::line(image_, toFixed(a), toFixed(b), color, toThickness(width), cv::LINE_AA, kShift);
  shape("polyline", {a, b}, stroke(color, width));
}

void PlotCanvas::dashedLine(cv::Point2d a, cv::Point2d b, const Color& color, double width) {
  polyline({a, b}, color, width, true);
}

void PlotCanvas::polyline(const std::vector<cv::Point2d>& points, const Color& color, double width,
                          bool dashed) {
  if (points.empty()) return;
  for (const auto& piece :
       dashed ? dashesOf(points) : std::vector<std::vector<cv::Point2d>>{points}) {
    std::vector<cv::Point> fixed;
    for (const cv::Point2d& p : piece) fixed.push_back(toFixed(p));
    cv::polylines(image_, fixed, false, color, toThickness(width), cv::LINE_AA, kShift);
  }
  std::string style = stroke(color, width);
  if (dashed) style += format(" stroke-dasharray=\"%g %g\"", kDash, kGap);
  shape("polyline", points, style);
}

void PlotCanvas::disc(cv::Point2d centre, double radius, const Color& color) {
  const int r = static_cast<int>(std::lround(radius * kOversampling * (1 << kShift)));
  cv::circle(image_, toFixed(centre), r, color, cv::FILLED, cv::LINE_AA, kShift);
  svg_ += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" %s/>\n", centre.x, centre.y, radius,
                 filled(color).c_str());
}

void PlotCanvas::diamond(cv::Point2d c, double r, const Color& color) {
  const std::vector<cv::Point> corners = {toFixed({c.x - r, c.y}), toFixed({c.x, c.y - r}),
                                          toFixed({c.x + r, c.y}), toFixed({c.x, c.y + r})};
  cv::fillConvexPoly(image_, corners, color, cv::LINE_AA, kShift);
  shape("polygon", {{c.x - r, c.y}, {c.x, c.y - r}, {c.x + r, c.y}, {c.x, c.y + r}}, filled(color));
}

void PlotCanvas::frame(const cv::Rect2d& box, const Color& color, double width) {
  cv::rectangle(image_, toFixed(box.tl()), toFixed(box.br()), color, toThickness(width),
                cv::LINE_AA, kShift);
  shape("polygon", cornersOf(box), stroke(color, width));
}

void PlotCanvas::fill(const cv::Rect2d& box, const Color& color) {
  cv::rectangle(image_, toFixed(box.tl()), toFixed(box.br()), color, cv::FILLED, cv::LINE_AA,
                kShift);
  shape("polygon", cornersOf(box), filled(color));
}

double PlotCanvas::textWidth(const std::string& text, double size) {
  return static_cast<double>(
             cv::getTextSize(text, kFont, fontScale(size), strokeWidth(size), nullptr).width) /
         kOversampling;
}

void PlotCanvas::text(cv::Point2d at, const std::string& text, double size, const Color& color,
                      TextAlign align) {
  letters(at, text, size, color,
          align == TextAlign::kLeft     ? "start"
          : align == TextAlign::kCentre ? "middle"
                                        : "end",
          "");
  if (align != TextAlign::kLeft)
    at.x -= textWidth(text, size) * (align == TextAlign::kCentre ? 0.5 : 1.0);
  const cv::Point origin(static_cast<int>(std::lround(at.x * kOversampling)),
                         static_cast<int>(std::lround(at.y * kOversampling)));
  cv::putText(image_, text, origin, kFont, fontScale(size), color, strokeWidth(size), cv::LINE_AA);
}

void PlotCanvas::verticalText(cv::Point2d at, const std::string& text, double size,
                              const Color& color) {
  const std::string turn = format(" transform=\"rotate(-90 %.1f %.1f)\"", at.x, at.y);
  letters({at.x, at.y + 0.5 * size}, text, size, color, "middle", turn);
  int below = 0;
  const cv::Size extent = cv::getTextSize(text, kFont, fontScale(size), strokeWidth(size), &below);
  const int margin = strokeWidth(size) + 1;
  cv::Mat letters(extent.height + below + 2 * margin, extent.width + 2 * margin, CV_8UC3,
                  cv::Scalar::all(255));
  cv::putText(letters, text, {margin, margin + extent.height}, kFont, fontScale(size), color,
              strokeWidth(size), cv::LINE_AA);
  cv::rotate(letters, letters, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect wanted(static_cast<int>(std::lround(at.x * kOversampling)) - letters.cols / 2,
                        static_cast<int>(std::lround(at.y * kOversampling)) - letters.rows / 2,
                        letters.cols, letters.rows);
  const cv::Rect inside = wanted & cv::Rect({0, 0}, image_.size());
  if (inside.empty()) return;
  cv::Mat target = image_(inside);
  cv::min(target, letters(inside - wanted.tl()), target);
}

void PlotCanvas::write(const std::string& path) const {
  if (std::filesystem::path(path).extension() != ".svg") return writePng(path);
  writeFile(path, svg());
}

std::string PlotCanvas::svg() const {
  const cv::Size size = image_.size() / kOversampling;
  const std::string head = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
      "viewBox=\"0 0 %d %d\" font-family=\"sans-serif\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      size.width, size.height, size.width, size.height);
  return head + svg_ + "</svg>\n";
}

void PlotCanvas::writePng(const std::string& path) const {
  cv::Mat small;
  cv::resize(image_, small, image_.size() / kOversampling, 0, 0, cv::INTER_AREA);
  std::vector<unsigned char> png;
  bool encoded = false;
  try {
    encoded = cv::imencode(std::filesystem::path(path).extension().string(), small, png);
  } catch (const cv::Exception&) {  // an extension that OpenCV does not know
  }
  if (!encoded)
    throw DataError(path, 0, "cannot be written; expected the path of a new .png or .svg file");
  writeFile(path, std::string(png.begin(), png.end()));
}

Ticks::Ticks(double low, double high, int at_most) {
  const double wanted = std::max(high - low, 1e-12) / std::max(1, at_most);
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= wanted * (1 - 1e-9)) {
      step = factor * power;
      break;
    }
  if (!std::isfinite(low) || !std::isfinite(high) || !std::isfinite(step)) return;
  first = std::ceil(low / step - 1e-9) * step;
  count = static_cast<int>(std::floor((high - first) / step + 1e-9)) + 1;
  decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
}

double Ticks::value(int i) const { return first + i * step; }

std::string Ticks::label(int i) const {
  // A tick within rounding of zero must not read "-0".
  const double v = std::abs(value(i)) < 1e-9 * step ? 0.0 : value(i);
  return format("%.*f", decimals, v);
}

void PlotArea::drawAxes(PlotCanvas* canvas, const std::string& x_label, const std::string& y_label,
                        int x_ticks, int y_ticks) const {
  const Ticks xs(x_low_, x_high_, x_ticks), ys(y_low_, y_high_, y_ticks);
  const double bottom = box_.y + box_.height;
  for (int i = 0; i < xs.count; ++i) {
    const double x = at(xs.value(i), y_low_).x;
    canvas->line({x, box_.y}, {x, bottom}, kGrid);
    canvas->line({x, bottom}, {x, bottom + 4}, kAxis);
    canvas->text({x, bottom + 18}, xs.label(i), kTickTextSize, kLabel, TextAlign::kCentre);
  }
  double widest = 0.0;
  for (int i = 0; i < ys.count; ++i) {
    const double y = at(x_low_, ys.value(i)).y;
    canvas->line({box_.x, y}, {box_.x + box_.width, y}, kGrid);
    canvas->line({box_.x - 4, y}, {box_.x, y}, kAxis);
    canvas->text({box_.x - 8, y + 0.5 * kTickTextSize}, ys.label(i), kTickTextSize, kLabel,
                 TextAlign::kRight);
    widest = std::max(widest, PlotCanvas::textWidth(ys.label(i), kTickTextSize));
  }
  canvas->frame(box_, kAxis);
  canvas->text({box_.x + 0.5 * box_.width, bottom + 38}, x_label, kLabelTextSize, kLabel,
               TextAlign::kCentre);
  canvas->verticalText({box_.x - 20 - widest, box_.y + 0.5 * box_.height}, y_label, kLabelTextSize,
                       kLabel);
}

}  // namespace etalon
