// Several trajectories in one picture: what is read back from the SVG, where every curve is a polyline in pixels.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "etalon/core/so3.h"
#include "etalon/report/plot.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct Polyline {
  std::string colour;
  std::vector<Eigen::Vector2d> points;
};

constexpr const char* kFirstRun = "#0072b2";
constexpr const char* kSecondRun = "#d55e00";
constexpr const char* kGroundTruth = "#a0a0a0";
constexpr size_t kPoses = 60;

/** Two turns about the vertical while it climbs, in a second. */
Trajectory spiral(const SE3& T_GW = SE3()) {
  Trajectory trajectory;
  for (size_t i = 0; i < kPoses; ++i) {
    const double s = 4.0 * M_PI * static_cast<double>(i) / kPoses;
    const SE3 T_WB(expSO3(Eigen::Vector3d(0, 0, s)),
                   Eigen::Vector3d(2.0 * std::cos(s), 2.0 * std::sin(s), 0.1 * s));
    trajectory.push_back({1'000'000'000 + static_cast<TimeNs>(i) * 16'000'000, T_GW * T_WB});
  }
  return trajectory;
}

GroundTruth truthOfSpiral() {
  GroundTruth truth;
  for (const StampedPose& pose : spiral()) {
    StampedState state;
    state.t = pose.t;
    state.T_WB = pose.T_WB;
    truth.states.push_back(state);
  }
  return truth;
}

class TrajectoriesPlot : public ::testing::Test {
 protected:
  std::string svgOf(const std::vector<NamedTrajectory>& runs, const GroundTruth& truth) const {
    drawTrajectories(folder_ / "plot.svg", runs, truth);
    std::ifstream file(folder_ / "plot.svg");
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /** The curves of trajectories: the grid's lines have two points. */
  std::vector<Polyline> curvesOf(const std::vector<NamedTrajectory>& runs,
                                 const GroundTruth& truth) const {
    std::vector<Polyline> curves;
    std::istringstream lines(svgOf(runs, truth));
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("<polyline", 0) != 0) continue;
      Polyline curve;
      curve.colour = line.substr(line.find("stroke=\"") + 8, 7);
      std::istringstream points(line.substr(line.find('"') + 1));
      char comma = 0;
      for (Eigen::Vector2d p; points >> p.x() >> comma >> p.y();) curve.points.push_back(p);
      if (curve.points.size() > 2) curves.push_back(curve);
    }
    return curves;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(TrajectoriesPlot, ACurveIsInTheTopViewAndInSixPanels) {
  const auto curves = curvesOf({{"a", spiral()}, {"b", spiral()}}, truthOfSpiral());
  ASSERT_EQ(curves.size(), 3 * 7u);
  for (size_t i = 0; i < curves.size(); i += 3) {  // the truth below, then the runs in their order
    EXPECT_EQ(curves[i].colour, kGroundTruth);
    EXPECT_EQ(curves[i + 1].colour, kFirstRun);
    EXPECT_EQ(curves[i + 2].colour, kSecondRun);
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(curves[i + k].points.size(), kPoses);
  }
}

TEST_F(TrajectoriesPlot, IsAlignedWithTheGroundTruthInYawAndPosition) {
  const SE3 T_GW(expSO3(Eigen::Vector3d(0, 0, 2.0)), Eigen::Vector3d(30, -20, 5));
  const auto curves = curvesOf({{"turned", spiral(T_GW)}}, truthOfSpiral());
  ASSERT_EQ(curves.size(), 2 * 7u);
  for (size_t i = 0; i < curves.size(); i += 2)
    for (size_t k = 0; k < kPoses; ++k)
      EXPECT_NEAR((curves[i].points[k] - curves[i + 1].points[k]).norm(), 0.0, 0.2);
}

TEST_F(TrajectoriesPlot, TheTopViewHasOneScale) {
  const auto curves = curvesOf({{"a", spiral()}}, {});
  ASSERT_EQ(curves.size(), 7u);  // no ground truth: as they are
  Eigen::Vector2d low = curves[0].points[0], high = low;
  for (const Eigen::Vector2d& p : curves[0].points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // A circle of 4 m, seen in steps of 12 deg.
  EXPECT_NEAR((high - low).x() / (high - low).y(), 1.0, 0.02);
}

TEST_F(TrajectoriesPlot, YawGoesOnBeyondHalfATurn) {
  const auto yaw = curvesOf({{"a", spiral()}}, {}).back().points;
  ASSERT_EQ(yaw.size(), kPoses);
  for (size_t k = 1; k < kPoses; ++k)  // upwards, evenly
    EXPECT_NEAR(yaw[k].y() - yaw[k - 1].y(), yaw[1].y() - yaw[0].y(), 0.2);
  EXPECT_LT(yaw.back().y(), yaw.front().y());
}

TEST_F(TrajectoriesPlot, TheLegendNamesEveryRunAndTheTruthIfThereIsOne) {
  std::vector<NamedTrajectory> runs;
  for (int i = 0; i < 12; ++i)  // more than a line of names, and than colours
    runs.push_back({"orbslam3_inertial_only_" + std::to_string(i), spiral()});
  const std::string svg = svgOf(runs, truthOfSpiral());
  for (const NamedTrajectory& run : runs) EXPECT_THAT(svg, HasSubstr(">" + run.name + "</text>"));
  EXPECT_THAT(svg, AllOf(HasSubstr("y=\"44.0\""), HasSubstr("y=\"66.0\""),
                         HasSubstr(">ground truth</text>"), HasSubstr(">yaw [deg]</text>")));
  EXPECT_THAT(svgOf(runs, {}), Not(HasSubstr("ground truth")));
}

TEST_F(TrajectoriesPlot, FromTheEighthRunOnLinesAreDashedInTheLegendToo) {
  const auto dashed = [&](size_t count) {
    const std::string svg = svgOf(std::vector<NamedTrajectory>(count, {"a", spiral()}), {});
    size_t lines = 0;
    for (size_t at = svg.find("dasharray"); at != std::string::npos;
         at = svg.find("dasharray", at + 1))
      ++lines;
    return lines;
  };
  EXPECT_EQ(dashed(7), 0U);
  EXPECT_EQ(dashed(8), 8U);  // the top view, six panels, the legend
  EXPECT_EQ(dashed(13), 6 * 8U);
}

TEST_F(TrajectoriesPlot, AGroundTruthOfAnotherTimeIsNotDrawn) {
  GroundTruth truth = truthOfSpiral();
  for (StampedState& state : truth.states) state.t += 1'000'000'000'000;
  EXPECT_EQ(curvesOf({{"a", spiral()}}, truth).size(), 7u);
}

}  // namespace
}  // namespace etalon
