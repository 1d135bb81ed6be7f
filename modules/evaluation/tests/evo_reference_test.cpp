#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "etalon/evaluation/metrics.h"

// What evo 1.36.5 computed for recorded estimates of a public odometry.

namespace etalon {
namespace {

struct Case {
  Trajectory estimate;
  GroundTruth ground_truth;
  nlohmann::json evo;
};

/** Evo associates to the nearest stamp within 10 ms and does not interpolate: the estimate's stamps
 * are moved there. */
Case loadCase(const std::string& name) {
  const std::string folder = std::string(EVO_REFERENCE) + "/" + name + "/";
  Case result;
  for (const StampedPose& pose : readTum(folder + "groundtruth.tum")) {
    GroundTruthState state;
    state.t = pose.t;
    state.T_WB = pose.T_WB;
    result.ground_truth.states.push_back(state);
  }
  const auto& states = result.ground_truth.states;
  for (const StampedPose& pose : readTum(folder + "estimate.tum")) {
    const auto nearest = std::min_element(states.begin(), states.end(), [&](auto& a, auto& b) {
      return std::llabs(a.t - pose.t) < std::llabs(b.t - pose.t);
    });
    if (std::llabs(nearest->t - pose.t) <= durationNs(0.01))
      result.estimate.push_back({nearest->t, pose.T_WB});
  }
  std::ifstream(folder + "evo.json") >> result.evo;
  return result;
}

void expectSame(const ErrorStatistics& ours, const nlohmann::json& evo) {
  // The files hold 9 decimals; evo's own pipeline works on the same text. 1e-6 relative leaves room
  // for its association of stamps as doubles.
  for (const auto& [name, value] : {std::pair<std::string, double>{"rmse", ours.rmse},
                                    {"mean", ours.mean},
                                    {"median", ours.median},
                                    {"max", ours.max}})
    EXPECT_NEAR(value, evo.at(name).get<double>(), 1e-6 * std::max(1.0, value)) << name;
}

class EvoReference : public testing::TestWithParam<std::string> {};

TEST_P(EvoReference, AbsoluteErrorsAgree) {
  const Case c = loadCase(GetParam());
  const TrajectoryErrors se3 =
      absoluteTrajectoryErrors(c.estimate, c.ground_truth, AlignmentType::kSE3);
  EXPECT_EQ(se3.position_m.count, c.evo.at("associated").get<size_t>());
  expectSame(se3.position_m, c.evo.at("ape_trans_se3"));
  expectSame(se3.rotation_deg, c.evo.at("ape_angle_deg_se3"));
  const TrajectoryErrors sim3 =
      absoluteTrajectoryErrors(c.estimate, c.ground_truth, AlignmentType::kSim3);
  expectSame(sim3.position_m, c.evo.at("ape_trans_sim3"));
  const auto alignment = alignTrajectory(c.estimate, c.ground_truth, AlignmentType::kSim3);
  ASSERT_TRUE(alignment.has_value());
  EXPECT_NEAR(alignment->scale, c.evo.at("align_sim3_scale").get<double>(), 1e-7);
}

TEST_P(EvoReference, RelativeErrorsAgree) {
  const Case c = loadCase(GetParam());
  for (const auto& [delta, suffix] : {std::pair<int, std::string>{1, "1f"}, {10, "10f"}}) {
    const TrajectoryErrors errors = relativeTrajectoryErrors(c.estimate, c.ground_truth, delta);
    expectSame(errors.position_m, c.evo.at("rpe_trans_" + suffix));
    expectSame(errors.rotation_deg, c.evo.at("rpe_angle_deg_" + suffix));
  }
}

INSTANTIATE_TEST_SUITE_P(Recordings, EvoReference,
                         testing::Values("MH_01_easy_real", "V1_02_medium"));

}  // namespace
}  // namespace etalon
