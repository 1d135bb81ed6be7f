#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "etalon/evaluation/trajectory_evaluation.h"

// What evo 1.36.5 computed for recorded estimates of a public odometry: every figure.

namespace etalon {
namespace {

/** A TUM case with evo's figures; counts those that were compared. */
class EvoReference : public ::testing::TestWithParam<std::string> {
 protected:
  EvoReference() {
    const std::string folder = std::string(EVO_REFERENCE) + "/" + GetParam() + "/";
    pair_ = associate(readTum(folder + "estimate.tum"), readTum(folder + "groundtruth.tum"));
    std::ifstream(folder + "evo.json") >> evo_;
  }

  /** Every statistic of this name, to 1e-6 of its size or absolutely (the sum of squares of angles
   * in degrees goes up to 500). */
  void expectSame(const std::string& name, const ErrorStatistics& ours) {
    const std::map<std::string, double> figures = {
        {"rmse", ours.rmse}, {"mean", ours.mean}, {"median", ours.median}, {"std", ours.std},
        {"min", ours.min},   {"max", ours.max},   {"sse", ours.sse}};
    for (const auto& [key, value] : evo_.at(name).items()) {
      const auto expected = value.get<double>();
      ASSERT_EQ(figures.count(key), 1u) << name << " " << key;
      EXPECT_NEAR(figures.at(key), expected, 1e-6 * std::max(1.0, expected)) << name << " " << key;
    }
    EXPECT_EQ(evo_.at(name).size(), figures.size());
    compared_.push_back(name);
  }

  AssociatedTrajectories pair_;
  nlohmann::json evo_;
  std::vector<std::string> compared_;
};

TEST_P(EvoReference, EveryFigureAgrees) {
  EXPECT_EQ(pair_.estimate.size(), evo_.at("associated").get<size_t>());
  compared_.emplace_back("associated");
  expectSame("ape_trans_raw", absoluteErrors(pair_, std::nullopt).position_m);
  const TrajectoryErrors se3 = absoluteErrors(pair_, AlignmentType::kSE3);
  expectSame("ape_trans_se3", se3.position_m);
  expectSame("ape_angle_deg_se3", se3.rotation_deg);
  expectSame("ape_trans_sim3", absoluteErrors(pair_, AlignmentType::kSim3).position_m);
  for (const auto& [suffix, delta] :
       {std::pair<std::string, RelativeDelta>{"1f", {1, DeltaUnit::kFrames}},
        {"10f", {10, DeltaUnit::kFrames}},
        {"1m", {1, DeltaUnit::kMeters}}}) {
    const TrajectoryErrors errors = relativeErrors(pair_, delta);
    expectSame("rpe_trans_" + suffix, errors.position_m);
    expectSame("rpe_angle_deg_" + suffix, errors.rotation_deg);
  }

  std::vector<Eigen::Vector3d> p_G, p_W;
  for (const StampedPose& pose : pair_.reference) p_G.push_back(pose.T_WB.t);
  for (const StampedPose& pose : pair_.estimate) p_W.push_back(pose.T_WB.t);
  const SE3 T_GW = alignPoints(p_G, p_W, AlignmentType::kSE3).T_GW;
  for (int r = 0; r < 3; ++r) {
    EXPECT_NEAR(T_GW.t[r], evo_.at("align_se3").at("t").at(r).get<double>(), 1e-6);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(T_GW.R(r, c), evo_.at("align_se3").at("R").at(r).at(c).get<double>(), 1e-6);
  }
  compared_.emplace_back("align_se3");
  EXPECT_NEAR(alignPoints(p_G, p_W, AlignmentType::kSim3).scale,
              evo_.at("align_sim3_scale").get<double>(), 1e-6);
  compared_.emplace_back("align_sim3_scale");

  for (const auto& [name, value] : evo_.items())
    EXPECT_EQ(std::count(compared_.begin(), compared_.end(), name), 1) << name;
}

INSTANTIATE_TEST_SUITE_P(Recordings, EvoReference,
                         ::testing::Values("MH_01_easy_real", "V1_02_medium"));

}  // namespace
}  // namespace etalon
