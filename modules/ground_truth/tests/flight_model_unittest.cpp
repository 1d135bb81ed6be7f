#include "flight_model.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "simulated_truth.h"

namespace etalon::ground_truth {
namespace {

constexpr double kAllHz = 1e6;

/** A quarter of a minute of a ground truth without errors, but for the shared ones. */
class ExactFlight : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Faults faults;
    faults.position_white = faults.rotation_white = 0.0;
    faults.position_smooth = faults.rotation_smooth = 0.0;
    truth_ = new SimulatedTruth(simulatedTruth(faults, 4, 8.0));
  }
  static void TearDownTestSuite() { delete truth_; }

  static FlightModel model(const ImuBuffer& imu, double step_s = 0.25, double row_step_s = 0.5) {
    return FlightModel(truth_->recorded.states, imu, ImuNoiseDensities(), step_s, row_step_s);
  }
  /** The IMU without what lies between two instants, seconds after its start. */
  static std::vector<ImuSample> withGap(double from_s, double to_s) {
    std::vector<ImuSample> samples = truth_->imu;
    const TimeNs start = samples.front().t;
    samples.erase(std::remove_if(samples.begin(), samples.end(),
                                 [&](const ImuSample& sample) {
                                   const double s = secondsBetween(start, sample.t);
                                   return from_s < s && s < to_s;
                                 }),
                  samples.end());
    return samples;
  }
  static SimulatedTruth* truth_;
};
SimulatedTruth* ExactFlight::truth_ = nullptr;

TEST_F(ExactFlight, NodesAreRowsAStepApart) {
  const ImuBuffer imu(truth_->imu);
  const FlightModel fine = model(imu, 0.05), coarse = model(imu, 0.25);
  EXPECT_EQ(fine.size(), truth_->recorded.states.size());
  ASSERT_GT(coarse.size(), 20u);
  for (size_t k = 1; k < coarse.size(); ++k)
    EXPECT_NEAR(secondsBetween(coarse.nodes()[k - 1].body.t, coarse.nodes()[k].body.t), 0.25, 1e-6);
  const Node& node = coarse.nodes()[4];
  EXPECT_EQ(node.T_GM.t, truth_->recorded.states[20].T_WB.t);
  EXPECT_EQ(node.body.t, truth_->recorded.states[20].t);
}

TEST_F(ExactFlight, VelocitiesStartFromTheRows) {
  const ImuBuffer imu(truth_->imu);
  const FlightModel flight = model(imu);
  for (const Node& node : flight.nodes()) {
    const Eigen::Vector3d v = truth_->R_GW * truth_->flight.at(node.body.t).v_WB;
    // A difference over 0.1 s at up to 5 m/s^2, the delay and the lever arm on top.
    EXPECT_LT((node.body.v_WB - v).norm(), 0.3);
  }
}

TEST_F(ExactFlight, AddMovesByWhatItSays) {
  const ImuBuffer imu(truth_->imu);
  FlightModel flight = model(imu);
  const Node before = flight.nodes()[3];
  std::vector<NodeVector> moves(flight.size(), NodeVector::Zero());
  moves[3] = NodeVector::LinSpaced(0.01, 0.27);
  BorderVector border = BorderVector::LinSpaced(0.001, 0.011);
  flight.add(moves, border);
  const Node& after = flight.nodes()[3];
  EXPECT_LT((after.body.minus(before.body) - moves[3].head<15>()).norm(), 1e-12);
  EXPECT_LT((after.errors.reshaped() - moves[3].tail<12>()).norm(), 1e-15);
  EXPECT_EQ(flight.shared().position_shift_s, border[kPositionShift]);
  EXPECT_EQ(flight.shared().rotation_shift_s, border[kRotationShift]);
  EXPECT_LT((logSO3(flight.shared().R_BM) - border.segment<3>(kTurn)).norm(), 1e-12);
  EXPECT_LT((flight.shared().lever_B - border.segment<3>(kLever)).norm(), 1e-15);
  EXPECT_NEAR(flight.shared().g_G.z(), -9.81 + border[kGravity + 2], 1e-12);
  EXPECT_EQ(flight.nodes()[2].errors.norm(), 0.0);
}

TEST_F(ExactFlight, TrueStatesLeaveNoResiduals) {
  // The states of the flight itself, in G, with the faults that the rows were made with.
  const Faults faults;
  SimulatedTruth at = *truth_;
  for (StampedState& row : at.recorded.states) {
    const SE3 T_WB = at.flight.at(row.t).T_WB;
    row.T_WB = SE3(at.R_GW * T_WB.R, at.R_GW * T_WB.t);
  }
  const ImuBuffer imu(truth_->imu);
  FlightModel flight(at.recorded.states, imu, ImuNoiseDensities(), 0.25, 0.5);
  BorderVector border = BorderVector::Zero();
  border[kPositionShift] = faults.position_shift_s;
  border[kRotationShift] = faults.rotation_shift_s;
  border.segment<3>(kTurn) = faults.turn;
  border.segment<3>(kLever) = faults.lever;
  std::vector<NodeVector> moves(flight.size(), NodeVector::Zero());
  for (size_t k = 0; k < flight.size(); ++k) {
    const Node& node = flight.nodes()[k];
    moves[k].segment<3>(state_index::kVelocity) =
        at.R_GW * at.flight.at(node.body.t).v_WB - node.body.v_WB;
    moves[k].segment<3>(state_index::kGyroBias) = randomImuBias(4).gyro;
    moves[k].segment<3>(state_index::kAccelBias) = randomImuBias(4).accel;
  }
  flight.add(moves, border);
  Linearisation linear = flight.linearise();
  for (Node& node : linear.nodes) node.T_GM = truth_->recorded.at(node.body.t)->T_WB;
  const auto rows = linear.rows(kAllHz, kAllHz);
  // The first node's shift leads before the first sample that surrounds it; noise of the IMU over
  // 12 ms, and its midpoint rule at 100 Hz.
  for (size_t k = 1; k < rows.size(); ++k) {
    EXPECT_LT(rows[k].position.norm(), 5e-5) << k;
    EXPECT_LT(rows[k].rotation.norm(), 5e-4) << k;
  }
}

TEST_F(ExactFlight, RowsMoveAsTheirDerivativesByTheStateSay) {
  const ImuBuffer imu(truth_->imu);
  FlightModel flight = model(imu);
  std::vector<NodeVector> moves(flight.size(), NodeVector::Constant(1e-3));
  flight.add(moves, BorderVector::Constant(2e-3));
  const size_t k = flight.size() / 2;
  const auto rows = flight.linearise().rows(kAllHz, kAllHz);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < kNodeSize; ++i) {
    // How the shifted body depends on the state is left to first order in the shift.
    const bool through_shift = i >= state_index::kGyroBias && i < kPositionError;
    FlightModel moved = flight;
    std::vector<NodeVector> one(flight.size(), NodeVector::Zero());
    one[k][i] = kStep;
    moved.add(one, BorderVector::Zero());
    const auto after = moved.linearise().rows(kAllHz, kAllHz);
    const Eigen::Vector3d position = (after[k].position - rows[k].position) / kStep;
    const Eigen::Vector3d rotation = (after[k].rotation - rows[k].rotation) / kStep;
    const double tolerance = through_shift ? 5e-3 : 0.03;
    EXPECT_LT((position - rows[k].J_position.col(i)).norm(), tolerance) << i;
    EXPECT_LT((rotation - rows[k].J_rotation.col(i)).norm(), tolerance) << i;
    // Through the low pass the neighbours' last digit moves.
    EXPECT_LT((after[k + 1].position - rows[k + 1].position).norm(), 1e-12) << i;
  }
}

TEST_F(ExactFlight, MotionAcrossAGapOfTheImuIsNotKnown) {
  const ImuBuffer imu(withGap(3.0, 3.4));
  const Linearisation linear = model(imu).linearise();
  size_t unknown = 0;
  for (size_t k = 0; k < linear.motions.size(); ++k) {
    if (linear.motions[k].known) continue;
    ++unknown;
    const double at = secondsBetween(truth_->imu.front().t, linear.nodes[k].body.t);
    EXPECT_GT(at, 2.7);
    EXPECT_LT(at, 3.4);
  }
  EXPECT_GE(unknown, 2u);
  EXPECT_LE(unknown, 3u);
  EXPECT_EQ(linear.stretches.size(), 1u);  // the rows have no gap
}

TEST_F(ExactFlight, LowPassesEndWhereRowsAreMissing) {
  std::vector<StampedState> rows = truth_->recorded.states;
  rows.erase(rows.begin() + 60, rows.begin() + 90);  // 1.5 s
  const ImuBuffer imu(truth_->imu);
  const FlightModel flight(rows, imu, ImuNoiseDensities(), 0.25, 0.5);
  const Linearisation linear = flight.linearise();
  ASSERT_EQ(linear.stretches.size(), 2u);
  const size_t second = static_cast<size_t>(linear.stretches[1]);
  EXPECT_GT(secondsBetween(linear.nodes[second - 1].body.t, linear.nodes[second].body.t), 1.4);
  EXPECT_TRUE(linear.nodes[second].counts);
  EXPECT_TRUE(linear.motions[second - 1].known);  // the IMU goes on
}

TEST_F(ExactFlight, CovarianceOfAMotionIsSplitByItsSources) {
  const ImuBuffer imu(truth_->imu);
  const Linearisation linear = model(imu).linearise();
  const MotionTerm& motion = linear.motions[5];
  const ImuNoiseDensities sheet;
  const Preintegration whole(imu.between(linear.nodes[5].body.t, linear.nodes[6].body.t),
                             linear.nodes[5].body.bias, sheet);
  Eigen::Matrix<double, 15, 15> sum = Eigen::Matrix<double, 15, 15>::Zero();
  for (const auto& part : motion.covariance) sum += part;
  EXPECT_LT((sum - whole.covariance()).norm(), 1e-12 * whole.covariance().norm());
  const auto& gyro = motion.covariance[kGyroNoise];
  EXPECT_NEAR(gyro(0, 0), motion.dt * std::pow(sheet.gyro_noise_density, 2.0), 1e-3 * gyro(0, 0));
}

}  // namespace
}  // namespace etalon::ground_truth
