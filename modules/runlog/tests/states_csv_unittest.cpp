#include "etalon/runlog/states_csv.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/imu/preintegration.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using Rows = std::vector<std::vector<std::string>>;

Rows cellsOf(const std::string& path) {
  Rows rows;
  std::ifstream lines(path);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream cells(line + ",");
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

Rows cellsOfStates(const std::vector<FrameEstimate>& estimates) {
  const testing::TemporaryFolder folder;
  writeStatesCsv(folder / "states.csv", estimates);
  return cellsOf(folder / "states.csv");
}

Rows cellsOfImuStates(const std::vector<ImuRateState>& states) {
  const testing::TemporaryFolder folder;
  writeImuStatesCsv(folder / "states_imu.csv", states);
  return cellsOf(folder / "states_imu.csv");
}

TEST(StatesCsv, EveryNumberStandsUnderItsName) {
  using namespace state_index;
  FrameEstimate estimate;
  estimate.t = 1403636584763555584;
  estimate.state = PipelineState::kInertial;
  estimate.nav.T_WB = SE3(expSO3({0, 0, 0.5 * M_PI}), {1, 2, 3});
  estimate.nav.v_WB = {4, 5, 6};
  estimate.nav.bias = {{7, 8, 9}, {10, 11, 12}};
  Eigen::Matrix<double, 15, 1> sigma;
  sigma.segment<3>(kRotation) << M_PI / 180.0, 2.0 * M_PI / 180.0, 3.0 * M_PI / 180.0;
  sigma.segment<3>(kPosition) << 0.1, 0.2, 0.3;
  sigma.segment<3>(kVelocity) << 0.4, 0.5, 0.6;
  sigma.segment<3>(kGyroBias) << 0.7, 0.8, 0.9;
  sigma.segment<3>(kAccelBias) << 1.1, 1.2, 1.3;
  estimate.pose_covariance = sigma.head<6>().cwiseAbs2().asDiagonal();
  estimate.motion_variance = sigma.tail<9>().cwiseAbs2();
  const auto rows = cellsOfStates({estimate});
  ASSERT_EQ(rows.size(), 2U);
  ASSERT_EQ(rows[1].size(), rows[0].size());
  const auto cell = [&](const std::string& name) {
    for (size_t i = 0; i < rows[0].size(); ++i)
      if (rows[0][i] == name) return rows[1][i];
    return "no column " + name;
  };
  EXPECT_EQ(cell("t_ns"), "1403636584763555584");
  EXPECT_EQ(cell("state"), toString(PipelineState::kInertial));
  EXPECT_EQ(cell("p_y_m"), "2");
  EXPECT_EQ(cell("q_x"), "0");
  EXPECT_EQ(cell("q_z"), "0.707106781");
  EXPECT_EQ(cell("q_w"), "0.707106781");
  EXPECT_EQ(cell("v_z_mps"), "6");
  EXPECT_EQ(cell("b_g_x_rps"), "7");
  EXPECT_EQ(cell("b_a_z_mps2"), "12");
  EXPECT_EQ(cell("sigma_rotation_y_deg"), "2");
  EXPECT_EQ(cell("sigma_p_z_m"), "0.3");
  EXPECT_EQ(cell("sigma_v_x_mps"), "0.4");
  EXPECT_EQ(cell("sigma_b_g_z_rps"), "0.9");
  EXPECT_EQ(cell("sigma_b_a_x_mps2"), "1.1");
}

TEST(StatesCsv, WhatStereoOdometryDoesNotKnowIsEmpty) {
  FrameEstimate estimate;  // velocity and biases are zero in it
  estimate.nav.T_WB.t = {1, 2, 3};
  const auto rows = cellsOfStates({estimate});
  ASSERT_EQ(rows[1].size(), rows[0].size());
  EXPECT_EQ(rows[1][2], "1");
  for (size_t i = 9; i < rows[1].size(); ++i) EXPECT_EQ(rows[1][i], "") << rows[0][i];
}

TEST(StatesCsv, OfNoFramesThereIsTheHeader) {
  EXPECT_EQ(cellsOfStates({}).size(), 1U);
  EXPECT_EQ(cellsOfImuStates({}).size(), 1U);
}

TEST(StatesCsv, SaysThatAFileCannotBeWritten) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(writeStatesCsv(folder / "no/such/states.csv", {}), DataError);
}

TEST(ImuStatesCsv, HasTheFirstColumnsOfTheFrames) {
  ImuRateState state;
  state.t = 1403636584763555584;
  state.state = PipelineState::kDeadReckoning;
  state.nav.T_WB = SE3(expSO3({M_PI / 3.0, 0, 0}), {1.0 / 3.0, -2, 1e-12});
  state.nav.v_WB = {4, -5.5, 6};
  state.nav.bias = {{7, 8, 9}, {10, 11, 12}};  // not in it
  ImuRateState later = state;
  later.t += 5'000'000;
  const auto rows = cellsOfImuStates({state, later});
  ASSERT_EQ(rows.size(), 3U);
  const std::vector<std::string> expected = {"1403636584763555584",
                                             "dead_reckoning",
                                             "0.333333333",
                                             "-2",
                                             "1e-12",
                                             "0.5",
                                             "0",
                                             "0",
                                             "0.866025404",
                                             "4",
                                             "-5.5",
                                             "6"};
  EXPECT_EQ(rows[1], expected);
  EXPECT_EQ(rows[2][0], "1403636584768555584");
  const auto frames = cellsOfStates({});
  EXPECT_EQ(rows[0], std::vector<std::string>(frames[0].begin(), frames[0].begin() + 12));
}

TEST(StatesCsv, ANegativeVarianceIsNoNumberButZero) {
  FrameEstimate estimate;
  estimate.pose_covariance.setZero();
  estimate.motion_variance.setZero();
  estimate.pose_covariance(3, 3) = -1e-20;  // rounding
  const auto rows = cellsOfStates({estimate});
  for (size_t i = 9; i < rows[1].size(); ++i) EXPECT_EQ(rows[1][i], "0") << rows[0][i];
}

}  // namespace
}  // namespace etalon
