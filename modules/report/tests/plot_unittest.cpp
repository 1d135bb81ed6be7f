#include "etalon/report/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/testing/example_run.h"
#include "plot_canvas.h"

namespace etalon {
namespace {

/** A figure of eight over 20 s, and an estimate that drifts away from it in another frame. */
struct DrawnFlight {
  Trajectory estimate;
  GroundTruth truth;

  DrawnFlight() {
    const SE3 T_WG(expSO3(Eigen::Vector3d(0, 0, 1.0)), Eigen::Vector3d(-3, 2, 1));
    truth.has_velocity = false;
    for (int i = 0; i <= 400; ++i) {
      const double s = i / 400.0 * 2 * M_PI;
      StampedState state;
      state.t = testing::kFirstImage + 50'000'000LL * i;
      state.T_WB =
          SE3(expSO3(Eigen::Vector3d(0.1 * std::sin(5 * s), 0.1 * std::cos(3 * s), s)),
              Eigen::Vector3d(3 * std::sin(s), 1.5 * std::sin(2 * s), 1 + 0.3 * std::cos(s)));
      truth.states.push_back(state);
      SE3 T = state.T_WB;
      T.t += 0.004 * s * Eigen::Vector3d(std::sin(9 * s), 2 * std::cos(4 * s), 1);
      T.R = T.R * expSO3(Eigen::Vector3d(0.001 * s, 0.002 * std::sin(7 * s), 0));
      estimate.push_back({state.t, T_WG * T});
    }
  }
};

/** Share of the pixels of a region whose colour is near this one, per mille. */
double share(const cv::Mat& image, const cv::Rect& region, const cv::Scalar& color) {
  cv::Mat mask;
  cv::inRange(image(region), color - cv::Scalar::all(40), color + cv::Scalar::all(40), mask);
  return 1000.0 * cv::countNonZero(mask) / region.area();
}

const cv::Scalar kBlue(180, 105, 20), kGrey(160, 160, 160), kRed(40, 40, 214);
const cv::Rect kLeft(95, 115, 680, 610), kUpper(895, 115, 670, 255), kLower(895, 470, 670, 255);

class Plot : public ::testing::Test {
 protected:
  cv::Mat draw(const Trajectory& estimate, const GroundTruth& truth,
               const TrajectoryPlotOptions& options) {
    const std::string path = folder_ / "trajectory.png";
    drawTrajectoryPlot(path, estimate, truth, options);
    const cv::Mat image = cv::imread(path);
    EXPECT_EQ(image.size(), cv::Size(1600, 800));
    return image;
  }
  testing::TemporaryFolder folder_;
  DrawnFlight flight_;
};

TEST_F(Plot, WithGroundTruthShowsBothCurvesTheErrorsAndTheInitialization) {
  TrajectoryPlotOptions options;
  options.title = "eta on a figure of eight";
  options.initialized_at = flight_.estimate[50].t;
  const cv::Mat image = draw(flight_.estimate, flight_.truth, options);
  for (const cv::Rect& region : {kLeft, kUpper, kLower}) {
    EXPECT_GT(share(image, region, kBlue), 1.0);
    EXPECT_GT(share(image, region, kRed), 0.1);
  }
  EXPECT_GT(share(image, kLeft, kGrey), 1.0);
}

TEST_F(Plot, OfPositionsBeyondAllBoundsThereIsAnEmptyPicture) {
  for (const double far : {1e200, std::numeric_limits<double>::max()}) {
    flight_.estimate[7].T_WB.t.setConstant(far);
    flight_.estimate[8].T_WB.t.setConstant(-far);
    draw(flight_.estimate, flight_.truth, {});
  }
}

TEST_F(Plot, WithoutGroundTruthAndInitialization) {
  const cv::Mat image = draw(flight_.estimate, {}, {});
  for (const cv::Rect& region : {kLeft, kUpper, kLower}) {
    EXPECT_GT(share(image, region, kBlue), 1.0);
    EXPECT_EQ(share(image, region, kRed), 0.0);
  }
}

TEST_F(Plot, AlignmentIsAnOption) {
  TrajectoryPlotOptions raw;
  raw.alignment.reset();
  const auto alignment =
      alignmentOf(associate(flight_.estimate, flight_.truth), AlignmentType::kYawPosition);
  ASSERT_TRUE(alignment.has_value());
  const cv::Mat by_option = draw(flight_.estimate, flight_.truth, {});
  const cv::Mat by_caller = draw(transformed(flight_.estimate, *alignment), flight_.truth, raw);
  const cv::Mat not_aligned = draw(flight_.estimate, flight_.truth, raw);
  for (const cv::Rect& region : {kLeft, kUpper, kLower}) {
    EXPECT_EQ(cv::norm(by_option(region), by_caller(region)), 0.0);
    EXPECT_GT(cv::norm(by_option(region), not_aligned(region)), 0.0);
  }
  // The pictures differ only in the headings, which name the alignment.
  EXPECT_GT(cv::norm(by_option, by_caller), 0.0);
}

TEST_F(Plot, ErrorsAreThoseOfTheGivenPairs) {
  Trajectory late;  // between two poses of the truth, and nearer to one of them
  for (StampedPose pose : flight_.estimate) {
    pose.t += 10'000'000;
    late.push_back(pose);
  }
  Trajectory reference;
  for (const StampedState& state : flight_.truth.states) reference.push_back({state.t, state.T_WB});
  TrajectoryPlotOptions options;
  options.alignment = AlignmentType::kSE3;
  const auto rmse = [](const AssociatedTrajectories& pairs) {
    char text[40];
    std::snprintf(text, sizeof text, "RMSE %.3g m,",
                  absoluteErrors(pairs, AlignmentType::kSE3).position_m.rmse);
    return std::string(text);
  };
  const std::string interpolated = rmse(associate(late, flight_.truth));
  options.pairs = associate(late, reference, 0.02);
  const std::string nearest = rmse(*options.pairs);
  ASSERT_NE(interpolated, nearest);
  EXPECT_NE(trajectoryPlotSvg(late, flight_.truth, options).find(nearest), std::string::npos);
  options.pairs.reset();
  EXPECT_NE(trajectoryPlotSvg(late, flight_.truth, options).find(interpolated), std::string::npos);
}

TEST_F(Plot, DegenerateTrajectories) {
  draw({}, {}, {});
  draw({}, flight_.truth, {});
  draw({flight_.estimate.front()}, flight_.truth, {});
  draw({flight_.estimate.front()}, {}, {});
  Trajectory still(flight_.estimate.begin(), flight_.estimate.begin() + 3);
  for (StampedPose& pose : still) pose.T_WB = SE3();
  draw(still, {}, {});
}

TEST_F(Plot, RefusesWhatCannotBeWritten) {
  EXPECT_THROW(drawTrajectoryPlot(folder_ / "no/such.png", flight_.estimate, {}), DataError);
  EXPECT_THROW(drawTrajectoryPlot(folder_ / "picture.xyz", flight_.estimate, {}), DataError);
}

TEST(PlotTicks, AreRoundAndInside) {
  const Ticks a(0.0, 1.0, 5);
  EXPECT_EQ(a.count, 6);
  EXPECT_EQ(a.label(1), "0.2");
  const Ticks b(-0.013, 0.029, 5);
  EXPECT_EQ(b.label(0), "-0.01");
  EXPECT_EQ(b.label(1), "0.00");
  EXPECT_EQ(b.count, 4);
  const Ticks c(3.0, 177.0, 8);
  EXPECT_EQ(c.label(0), "50");
  EXPECT_EQ(c.label(c.count - 1), "150");
  for (const double width : {1e-9, 0.37, 1.0, 42.0, 1e6}) {
    const Ticks t(-0.3 * width, 0.7 * width, 6);
    EXPECT_GE(t.count, 2);
    EXPECT_LE(t.count, 8);
    EXPECT_GE(t.value(0), -0.3 * width - 1e-9 * width);
    EXPECT_LE(t.value(t.count - 1), 0.7 * width + 1e-9 * width);
  }
}

TEST_F(Plot, SeveralTrajectoriesAreDrawnInOnePicture) {
  Trajectory half(flight_.estimate.begin(), flight_.estimate.begin() + 200);
  const std::string png = folder_ / "runs.png", svg = folder_ / "runs.svg";
  for (const std::string& path : {png, svg})
    drawTrajectories(path, {{"whole", flight_.estimate}, {"half & more", half}}, flight_.truth);
  const cv::Mat image = cv::imread(png);
  ASSERT_EQ(image.size(), cv::Size(1800, 900));
  const cv::Rect top(95, 115, 550, 710), last_yaw(1600, 645, 160, 180);
  const cv::Scalar first_run(178, 114, 0), second_run(0, 94, 213);
  EXPECT_GT(share(image, top, first_run), 1.0);
  EXPECT_GT(share(image, top, second_run), 1.0);
  EXPECT_GT(share(image, last_yaw, first_run), 1.0);
  EXPECT_LT(share(image, last_yaw, second_run), 0.1);  // it ended before

  std::ifstream file(svg);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(text.rfind("<svg xmlns", 0), 0u);
  EXPECT_NE(text.find(">half &amp; more</text>"), std::string::npos);
  EXPECT_NE(text.find("stroke=\"#0072b2\""), std::string::npos);
  EXPECT_EQ(text.substr(text.size() - 7), "</svg>\n");
}

TEST_F(Plot, NothingToDrawIsAnEmptyPicture) {
  drawTrajectories(folder_ / "none.png", {{"none", {}}}, {});
  EXPECT_EQ(cv::imread(folder_ / "none.png").size(), cv::Size(1800, 900));
}

}  // namespace
}  // namespace etalon
