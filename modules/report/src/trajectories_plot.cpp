#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "etalon/core/angles.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/report/plot.h"
#include "plot_canvas.h"

namespace etalon {
namespace {

constexpr int kWidth = 1800, kHeight = 900;
const cv::Rect2d kTopView(90, 110, 560, 720);
constexpr double kPanelWidth = 470, kPanelHeight = 190, kPanelStep = 265;
const Color kTruthColor(160, 160, 160), kTextColor(30, 30, 30);
constexpr double kTextSize = 10.5;

/** Colours that differ in print and for the colour-blind (Okabe and Ito, 2008). */
const std::array<Color, 7> kColors = {Color(178, 114, 0),   Color(0, 94, 213),  Color(115, 158, 0),
                                      Color(167, 121, 204), Color(0, 159, 230), Color(233, 180, 86),
                                      Color(20, 20, 20)};

/** What is drawn of a trajectory at an instant. */
struct Sample {
  double time_s = 0.0;
  std::array<double, 6> value{};  ///< x, y, z [m]; roll, pitch, yaw [deg]
};

struct Curve {
  std::string name;
  Color color;
  double width = 1.4;
  std::vector<Sample> samples;
  bool dashed = false;
};

/** Brings an angle to the turn nearest to the one before, deg. */
double unwrapped(double angle, double before) {
  return angle + 360.0 * std::round((before - angle) / 360.0);
}

/** Roll, pitch and yaw (Z-Y-X) of the rotation since `R_first`, about the world's axes. */
std::vector<Sample> samplesOf(const Trajectory& trajectory, TimeNs t0,
                              const Eigen::Matrix3d& R_first) {
  std::vector<Sample> samples;
  for (const StampedPose& pose : trajectory) {
    const Eigen::Matrix3d R = pose.T_WB.R * R_first.transpose();
    Sample s;
    s.time_s = secondsBetween(t0, pose.t);
    for (int i = 0; i < 3; ++i) s.value[i] = pose.T_WB.t[i];
    s.value[3] = degrees(std::atan2(R(2, 1), R(2, 2)));
    s.value[4] = degrees(std::asin(std::clamp(-R(2, 0), -1.0, 1.0)));
    s.value[5] = degrees(std::atan2(R(1, 0), R(0, 0)));
    if (!samples.empty())
      for (const int i : {3, 5}) s.value[i] = unwrapped(s.value[i], samples.back().value[i]);
    samples.push_back(s);
  }
  return samples;
}

/** The least and the greatest value over all curves, with a margin. */
std::pair<double, double> rangeOf(const std::vector<Curve>& curves, int quantity) {
  double low = INFINITY, high = -INFINITY;
  for (const Curve& curve : curves)
    for (const Sample& s : curve.samples) {
      low = std::min(low, s.value[quantity]);
      high = std::max(high, s.value[quantity]);
    }
  if (low > high) return {-1.0, 1.0};
  const double margin = std::max(0.06 * (high - low), 0.01);
  return {low - margin, high + margin};
}

void drawCurves(const std::vector<Curve>& curves, const PlotArea& area, PlotCanvas* canvas,
                const std::function<cv::Point2d(const Sample&)>& place) {
  for (const Curve& curve : curves) {
    std::vector<cv::Point2d> points;
    for (const Sample& s : curve.samples) {
      const cv::Point2d p = place(s);
      points.push_back(area.at(p.x, p.y));
    }
    canvas->polyline(points, curve.color, curve.width, curve.dashed);
  }
}

void drawTopView(const std::vector<Curve>& curves, PlotCanvas* canvas) {
  const auto [x_low, x_high] = rangeOf(curves, 0);
  const auto [y_low, y_high] = rangeOf(curves, 1);
  const double scale =
      std::max((x_high - x_low) / kTopView.width, (y_high - y_low) / kTopView.height);
  const double x = 0.5 * (x_low + x_high), y = 0.5 * (y_low + y_high);
  const double half_x = 0.5 * scale * kTopView.width, half_y = 0.5 * scale * kTopView.height;
  const PlotArea area(kTopView, x - half_x, x + half_x, y - half_y, y + half_y);
  area.drawAxes(canvas, "x [m]", "y [m]", 7, 9);
  drawCurves(curves, area, canvas,
             [](const Sample& s) { return cv::Point2d(s.value[0], s.value[1]); });
}

void drawPanels(const std::vector<Curve>& curves, double duration_s, PlotCanvas* canvas) {
  const char* labels[] = {"x [m]", "y [m]", "z [m]", "roll [deg]", "pitch [deg]", "yaw [deg]"};
  for (int q = 0; q < 6; ++q) {
    const auto [low, high] = rangeOf(curves, q);
    const cv::Rect2d box(q < 3 ? 740 : 1300, kTopView.y + (q % 3) * kPanelStep, kPanelWidth,
                         kPanelHeight);
    const PlotArea area(box, 0.0, duration_s, low, high);
    area.drawAxes(canvas, "time [s]", labels[q], 8, 5);
    drawCurves(curves, area, canvas,
               [q](const Sample& s) { return cv::Point2d(s.time_s, s.value[q]); });
  }
}

void drawLegend(const std::vector<Curve>& curves, PlotCanvas* canvas) {
  double x = kTopView.x, y = 44;
  for (const Curve& curve : curves) {
    const double width = 38 + PlotCanvas::textWidth(curve.name, kTextSize) + 28;
    if (x + width > kWidth - 20 && x > kTopView.x) {
      x = kTopView.x;
      y += 22;
    }
    const double middle = y - 0.5 * kTextSize;
    canvas->polyline({{x, middle}, {x + 30, middle}}, curve.color, std::max(2.0, curve.width),
                     curve.dashed);
    canvas->text({x + 38, y}, curve.name, kTextSize, kTextColor);
    x += width;
  }
}

}  // namespace

void drawTrajectories(const std::string& path, const std::vector<NamedTrajectory>& runs,
                      const GroundTruth& ground_truth, AlignmentType alignment) {
  std::vector<Trajectory> aligned;
  std::vector<Curve> curves;
  TimeNs first = std::numeric_limits<TimeNs>::max(), last = std::numeric_limits<TimeNs>::min();
  for (const NamedTrajectory& run : runs) {
    const auto found = alignmentOf(associate(run.trajectory, ground_truth), alignment);
    aligned.push_back(found ? transformed(run.trajectory, *found) : run.trajectory);
    if (aligned.back().empty()) continue;
    first = std::min(first, aligned.back().front().t);
    last = std::max(last, aligned.back().back().t);
  }
  Trajectory truth;
  for (const StampedState& state : ground_truth.states)
    if (state.t >= first && state.t <= last) truth.push_back({state.t, state.T_WB});
  Eigen::Matrix3d R_first = Eigen::Matrix3d::Identity();
  for (const Trajectory& t : aligned)
    if (!t.empty() && t.front().t == first) R_first = t.front().T_WB.R;
  if (!truth.empty()) {
    R_first = truth.front().T_WB.R;
    curves.push_back({"ground truth", kTruthColor, 3.5, samplesOf(truth, first, R_first)});
  }
  for (size_t i = 0; i < runs.size(); ++i)
    curves.push_back({runs[i].name, kColors[i % kColors.size()], 1.4,
                      samplesOf(aligned[i], first, R_first), i / kColors.size() % 2 == 1});

  PlotCanvas canvas(kWidth, kHeight);
  drawLegend(curves, &canvas);
  drawTopView(curves, &canvas);
  drawPanels(curves, first < last ? secondsBetween(first, last) : 1.0, &canvas);
  canvas.write(path);
}

}  // namespace etalon
