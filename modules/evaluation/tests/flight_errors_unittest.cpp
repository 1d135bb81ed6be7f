// Errors of a flight beside what its covariance predicts: units, frames, and where they count from.

#include "etalon/evaluation/flight_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kDeg = M_PI / 180.0;
constexpr TimeNs kStep = 50'000'000;

/** Truth in its own world G, and an estimate without errors in a world W that is turned about z and
 * moved; a covariance of the identity. */
struct EstimatedFlight {
  GroundTruth truth;
  std::vector<FrameEstimate> estimates;
  SE3 T_WG{expSO3({0.0, 0.0, 1.1}), {5.0, -2.0, 0.5}};

  explicit EstimatedFlight(int frames = 10) {
    truth.has_velocity = truth.has_biases = true;
    for (int k = 0; k < frames; ++k) {
      StampedState state;
      state.t = kStep * k;
      state.T_WB = {expSO3({0.2 * k, -0.1, 0.3 * k}), {0.1 * k, 0.2 * k, 1.0}};
      state.v_WB = {1.0, 2.0, 0.1 * k};
      state.bias = {{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
      truth.states.push_back(state);
      FrameEstimate estimate;
      estimate.t = state.t;
      estimate.nav = state;
      estimate.nav.T_WB = T_WG * state.T_WB;
      estimate.nav.v_WB = T_WG.R * state.v_WB;
      estimate.pose_covariance.setIdentity();
      estimate.motion_variance.setOnes();
      estimates.push_back(estimate);
    }
  }
  std::vector<FlightErrors> errors() const { return flightErrors(estimates, truth); }
};

/** Expects all errors of the frame but the named ones to be zero to rounding. */
void expectOnly(const FlightErrors& errors,
                const std::vector<std::pair<ErrorAndSigma FlightErrors::*, double>>& expected) {
  for (const FlightFigure& figure : flightFigures()) {
    double value = 0.0;
    for (const auto& [member, error] : expected)
      if (member == figure.member) value = error;
    EXPECT_NEAR((errors.*figure.member).error, value, 1e-9) << figure.key;
  }
}

TEST(FlightErrors, AnotherWorldIsNoError) {
  for (const FlightErrors& errors : EstimatedFlight().errors()) expectOnly(errors, {});
}

TEST(FlightErrors, EachIsInItsOwnUnit) {
  EstimatedFlight flight;
  NavState& nav = flight.estimates[7].nav;
  nav.T_WB.t += Vector3d(0.3, 0.0, 0.4);
  nav.v_WB += Vector3d(0.0, 0.03, 0.04);
  nav.bias.gyro += Vector3d(3e-3, 4e-3, 0.0);
  nav.bias.accel -= Vector3d(0.0, 0.06, 0.08);
  nav.T_WB.R = expSO3({0.0, 0.0, -2.0 * kDeg}) * nav.T_WB.R;
  const auto errors = flight.errors();
  expectOnly(errors[7], {{&FlightErrors::position_m, 0.5},
                         {&FlightErrors::velocity_mps, 0.05},
                         {&FlightErrors::gyro_bias_rps, 5e-3},
                         {&FlightErrors::accel_bias_mps2, 0.1},
                         {&FlightErrors::yaw_deg, 2.0}});
  expectOnly(errors[8], {});
  // A tilt is about the level axes, whatever the body's attitude.
  flight = EstimatedFlight();
  flight.estimates[7].nav.T_WB.R =
      expSO3(kDeg * Vector3d(0.6, 0.8, 0.0)) * flight.estimates[7].nav.T_WB.R;
  expectOnly(flight.errors()[7], {{&FlightErrors::tilt_deg, 1.0}});
}

TEST(FlightErrors, WhatIsPredictedIsTheRootOfTheTraceInWorldAxes) {
  EstimatedFlight flight;
  FrameEstimate& e = flight.estimates[3];
  // The body's x axis points up: an error about it is one of yaw.
  e.nav.T_WB.R = expSO3({0.0, -M_PI / 2, 0.0});
  ASSERT_LT((e.nav.T_WB.R * Vector3d::UnitX() - Vector3d::UnitZ()).norm(), 1e-12);
  e.pose_covariance.setZero();
  e.pose_covariance.diagonal() << std::pow(2.0 * kDeg, 2), std::pow(0.3 * kDeg, 2),
      std::pow(0.4 * kDeg, 2), 0.01, 0.04, 0.04;
  e.motion_variance << 1.0, 4.0, 4.0, 1e-6, 4e-6, 4e-6, 0.0, 0.0, 0.25;
  const FlightErrors errors = flight.errors()[3];
  EXPECT_NEAR(errors.yaw_deg.sigma, 2.0, 1e-9);
  EXPECT_NEAR(errors.tilt_deg.sigma, 0.5, 1e-9);
  EXPECT_NEAR(errors.position_m.sigma, 0.3, 1e-12);
  EXPECT_NEAR(errors.velocity_mps.sigma, 3.0, 1e-12);
  EXPECT_NEAR(errors.gyro_bias_rps.sigma, 3e-3, 1e-12);
  EXPECT_NEAR(errors.accel_bias_mps2.sigma, 0.5, 1e-12);
}

TEST(FlightErrors, PositionAndYawCountFromTheLastStart) {
  EstimatedFlight flight;
  // From frame 5 on the world is a new one; in between stereo odometry runs for a frame.
  const SE3 jump(expSO3({0.0, 0.0, 0.7}), {1.0, 1.0, 0.0});
  for (size_t k = 5; k < 10; ++k) {
    FrameEstimate& e = flight.estimates[k];
    e.nav.T_WB = jump * e.nav.T_WB;
    e.nav.v_WB = jump.R * e.nav.v_WB;
  }
  EXPECT_GT(flight.errors()[6].position_m.error, 1.0);
  EXPECT_NEAR(flight.errors()[6].yaw_deg.error, 0.7 / kDeg, 1e-6);
  flight.estimates[4].motion_variance.setConstant(FrameEstimate::kUnknown);
  const auto errors = flight.errors();
  for (const size_t k : {3, 5, 9}) expectOnly(errors[k], {});
  for (const FlightFigure& figure : flightFigures()) {
    EXPECT_TRUE(std::isnan((errors[4].*figure.member).error)) << figure.key;
    EXPECT_TRUE(std::isnan((errors[4].*figure.member).sigma)) << figure.key;
  }
}

TEST(FlightErrors, TheAlignmentKeepsRollAndPitchAsTheyAre) {
  // A start that is tilted by a degree stays tilted, because no turn about z removes it.
  EstimatedFlight flight;
  for (FrameEstimate& e : flight.estimates) {
    const SE3 tilt(expSO3({kDeg, 0.0, 0.0}), Vector3d::Zero());
    e.nav.T_WB = tilt * e.nav.T_WB;
    e.nav.v_WB = tilt.R * e.nav.v_WB;
  }
  for (const FlightErrors& errors : flight.errors()) EXPECT_NEAR(errors.tilt_deg.error, 1.0, 1e-3);
}

TEST(FlightErrors, WithoutTruthThereIsWhatIsPredictedAlone) {
  EstimatedFlight flight;
  flight.truth.states.erase(flight.truth.states.begin() + 4, flight.truth.states.begin() + 8);
  const auto errors = flight.errors();
  ASSERT_EQ(errors.size(), 10U);
  EXPECT_TRUE(std::isnan(errors[5].position_m.error));
  EXPECT_NEAR(errors[5].position_m.sigma, std::sqrt(3.0), 1e-12);
  expectOnly(errors[9], {});
  flight.truth = {};
  EXPECT_TRUE(std::isnan(flight.errors()[0].tilt_deg.error));
  EXPECT_TRUE(flightErrors({}, flight.truth).empty());
}

TEST(FlightErrors, OfATruthOfPosesAloneNoMotionIsJudged) {
  EstimatedFlight flight;
  flight.truth.has_velocity = flight.truth.has_biases = false;
  const FlightErrors errors = flight.errors()[9];
  EXPECT_TRUE(std::isnan(errors.velocity_mps.error));
  EXPECT_TRUE(std::isnan(errors.gyro_bias_rps.error));
  EXPECT_TRUE(std::isnan(errors.accel_bias_mps2.error));
  EXPECT_EQ(errors.velocity_mps.sigma, std::sqrt(3.0));
}

}  // namespace
}  // namespace etalon
