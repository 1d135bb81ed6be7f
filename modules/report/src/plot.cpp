#include "etalon/report/plot.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "etalon/core/text.h"
#include "plot_canvas.h"

namespace etalon {
namespace {

constexpr int kWidth = 1600, kHeight = 800;
const cv::Rect2d kTopViewBox(90, 110, 690, 620);
const cv::Rect2d kUpperBox(890, 110, 680, 265);
const cv::Rect2d kLowerBox(890, 465, 680, 265);

const Color kEstimate(180, 105, 20);    // blue
const Color kTruth(160, 160, 160);      // grey
const Color kStart(70, 70, 70);         // dark grey
const Color kInitialized(40, 40, 214);  // red
const Color kText(30, 30, 30);

constexpr double kTitleSize = 15.0, kHeadingSize = 10.5;

/** A curve over time, with the heading and label of its panel. */
struct Series {
  std::string heading, label;
  std::vector<double> time_s, value;
  bool from_zero = false;  ///< the axis starts at zero
};

class TrajectoryPlot {
 public:
  TrajectoryPlot(const Trajectory& estimate, const GroundTruth& ground_truth,
                 const TrajectoryPlotOptions& options)
      : estimate_(estimate), options_(options), canvas_(kWidth, kHeight) {
    if (estimate_.empty()) return;
    AssociatedTrajectories pairs =
        options.pairs ? *options.pairs : associate(estimate, ground_truth);
    if (options.alignment)
      if (const auto alignment = alignmentOf(pairs, *options.alignment)) {
        estimate_ = transformed(estimate, *alignment);
        pairs.estimate = transformed(pairs.estimate, *alignment);
      }
    for (const StampedState& state : ground_truth.states)
      if (state.t >= estimate.front().t && state.t <= estimate.back().t)
        truth_.push_back(state.T_WB.t);
    errors_ = poseErrors(pairs);
  }

  void draw() {
    canvas_.text({kTopViewBox.x, 44}, options_.title, kTitleSize, kText);
    if (estimate_.empty()) {
      canvas_.text({kWidth / 2.0, kHeight / 2.0}, "no poses", kTitleSize, kText,
                   TextAlign::kCentre);
      return;
    }
    drawTopView();
    const bool with_truth = !errors_.empty();
    drawSeries(kUpperBox, with_truth ? positionError() : height());
    drawSeries(kLowerBox, with_truth ? rotationError() : speed());
  }

  void write(const std::string& path) const { canvas_.write(path); }
  std::string svg() const { return canvas_.svg(); }

 private:
  double secondsAt(TimeNs t) const { return secondsBetween(estimate_.front().t, t); }
  double duration() const { return std::max(1e-3, secondsAt(estimate_.back().t)); }

  /** The pose nearest to the instant of initialization, if that lies in the trajectory. */
  const StampedPose* initialPose() const {
    const auto t = options_.initialized_at;
    if (!t || *t < estimate_.front().t || *t > estimate_.back().t) return nullptr;
    return &*std::min_element(estimate_.begin(), estimate_.end(), [&](auto& a, auto& b) {
      return std::llabs(a.t - *t) < std::llabs(b.t - *t);
    });
  }

  PlotArea topViewArea() const {
    Eigen::Vector2d low = estimate_.front().T_WB.t.head<2>(), high = low;
    const auto include = [&](const Eigen::Vector3d& p) {
      low = low.cwiseMin(p.head<2>());
      high = high.cwiseMax(p.head<2>());
    };
    for (const StampedPose& pose : estimate_) include(pose.T_WB.t);
    for (const Eigen::Vector3d& p : truth_) include(p);
    const Eigen::Vector2d centre = 0.5 * (low + high);
    // Metres per pixel: the same in both directions, with a margin of 8 % around, and at least
    // 10 cm across.
    const Eigen::Vector2d size = (1.16 * (high - low)).cwiseMax(0.1);
    const double scale = std::max(size.x() / kTopViewBox.width, size.y() / kTopViewBox.height);
    const double half_x = 0.5 * scale * kTopViewBox.width,
                 half_y = 0.5 * scale * kTopViewBox.height;
    return {kTopViewBox, centre.x() - half_x, centre.x() + half_x, centre.y() - half_y,
            centre.y() + half_y};
  }

  void drawTopView() {
    const PlotArea area = topViewArea();
    area.drawAxes(&canvas_, "x [m]", "y [m]", 9, 9);
    std::vector<cv::Point2d> truth, estimate;
    for (const Eigen::Vector3d& p : truth_) truth.push_back(area.at(p.x(), p.y()));
    for (const StampedPose& pose : estimate_)
      estimate.push_back(area.at(pose.T_WB.t.x(), pose.T_WB.t.y()));
    canvas_.polyline(truth, kTruth, 4.0);
    canvas_.polyline(estimate, kEstimate, 1.6);
    canvas_.disc(estimate.front(), 5.5, kStart);
    const StampedPose* initial = initialPose();
    if (initial)
      canvas_.diamond(area.at(initial->T_WB.t.x(), initial->T_WB.t.y()), 8.0, kInitialized);
    drawLegend(initial != nullptr);
  }

  void drawLegend(bool initialized) {
    double x = kTopViewBox.x;
    const double y = kTopViewBox.y - 16, middle = y - 0.5 * kHeadingSize;
    const auto entry = [&](const std::string& name, const std::function<void()>& symbol) {
      symbol();
      canvas_.text({x + 38, y}, name, kHeadingSize, kText);
      x += 38 + PlotCanvas::textWidth(name, kHeadingSize) + 28;
    };
    entry(options_.estimate_name, [&] {
      canvas_.line({x, middle}, {x + 30, middle}, kEstimate, 2.0);
    });
    if (!truth_.empty())
      entry(options_.truth_name, [&] { canvas_.line({x, middle}, {x + 30, middle}, kTruth, 4.0); });
    entry("start", [&] { canvas_.disc({x + 20, middle}, 5.5, kStart); });
    if (initialized)
      entry("initialized", [&] { canvas_.diamond({x + 20, middle}, 8.0, kInitialized); });
  }

  void drawSeries(const cv::Rect2d& box, const Series& series) {
    double low = 0.0, high = 1e-9;
    if (!series.value.empty()) {
      const auto [least, greatest] = std::minmax_element(series.value.begin(), series.value.end());
      low = series.from_zero ? 0.0 : *least;
      high = *greatest;
    }
    const double margin = std::max(0.08 * (high - low), 1e-6);
    // The margin above is doubled for the initialization's label.
    const PlotArea area(box, 0.0, duration(), series.from_zero ? 0.0 : low - margin,
                        high + 2.0 * margin);
    area.drawAxes(&canvas_, "time since the first pose [s]", series.label, 10, 7);
    canvas_.text({box.x, box.y - 16}, series.heading, kHeadingSize, kText);
    std::vector<cv::Point2d> curve;
    for (size_t i = 0; i < series.value.size(); ++i)
      curve.push_back(area.at(series.time_s[i], series.value[i]));
    canvas_.polyline(curve, kEstimate, 1.6);
    if (!initialPose()) return;
    const double t_s = secondsAt(*options_.initialized_at);
    const double x = area.at(t_s, 0.0).x;
    canvas_.dashedLine({x, box.y}, {x, box.y + box.height}, kInitialized, 1.4);
    const std::string label = format("initialized, %.2f s", t_s);
    const bool left = x + 160 > box.x + box.width;
    canvas_.text({x + (left ? -7 : 7), box.y + 17}, label, 9.0, kInitialized,
                 left ? TextAlign::kRight : TextAlign::kLeft);
  }

  static std::string headingOf(const std::string& name, const std::string& unit,
                               const std::vector<double>& values) {
    const ErrorStatistics s = statisticsOf(values);
    return format("%s: RMSE %.3g %s, median %.3g, max %.3g", name.c_str(), s.rmse, unit.c_str(),
                  s.median, s.max);
  }

  /** The alignment before the errors, as a part of a heading. */
  std::string alignmentName() const {
    if (!options_.alignment) return "not aligned";
    switch (*options_.alignment) {
      case AlignmentType::kSE3:
        return "SE(3)-aligned";
      case AlignmentType::kSim3:
        return "Sim(3)-aligned";
      case AlignmentType::kYawPosition:
        return "yaw-aligned";
    }
    return "";
  }

  Series positionError() const {
    Series series{"", "position error [m]", {}, {}, true};
    for (const PoseError& e : errors_) {
      series.time_s.push_back(secondsAt(e.t));
      series.value.push_back(e.position_m);
    }
    series.heading = headingOf("Position error, " + alignmentName(), "m", series.value);
    return series;
  }

  Series rotationError() const {
    Series series{"", "rotation error [deg]", {}, {}, true};
    for (const PoseError& e : errors_) {
      series.time_s.push_back(secondsAt(e.t));
      series.value.push_back(e.rotation_deg);
    }
    series.heading = headingOf("Rotation error, " + alignmentName(), "deg", series.value);
    return series;
  }

  Series height() const {
    Series series{"Height (no ground truth)", "z [m]", {}, {}, false};
    for (const StampedPose& pose : estimate_) {
      series.time_s.push_back(secondsAt(pose.t));
      series.value.push_back(pose.T_WB.t.z());
    }
    return series;
  }

  /** Central differences of positions. */
  Series speed() const {
    Series series{"Speed, from positions", "speed [m/s]", {}, {}, true};
    for (size_t i = 1; i + 1 < estimate_.size(); ++i) {
      const StampedPose &before = estimate_[i - 1], &after = estimate_[i + 1];
      series.time_s.push_back(secondsAt(estimate_[i].t));
      series.value.push_back((after.T_WB.t - before.T_WB.t).norm() /
                             secondsBetween(before.t, after.t));
    }
    return series;
  }

  Trajectory estimate_;  ///< aligned
  TrajectoryPlotOptions options_;
  std::vector<Eigen::Vector3d> truth_;
  std::vector<PoseError> errors_;
  PlotCanvas canvas_;
};

}  // namespace

void drawTrajectoryPlot(const std::string& path, const Trajectory& estimate,
                        const GroundTruth& ground_truth, const TrajectoryPlotOptions& options) {
  TrajectoryPlot plot(estimate, ground_truth, options);
  plot.draw();
  plot.write(path);
}

std::string trajectoryPlotSvg(const Trajectory& estimate, const GroundTruth& ground_truth,
                              const TrajectoryPlotOptions& options) {
  TrajectoryPlot plot(estimate, ground_truth, options);
  plot.draw();
  return plot.svg();
}

}  // namespace etalon
