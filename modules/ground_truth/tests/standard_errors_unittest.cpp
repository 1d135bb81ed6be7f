#include "standard_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulated_truth.h"

namespace etalon::ground_truth {
namespace {

/** One fault alone, as it should be found in the border. */
struct OneFault {
  const char* name;
  Faults faults;
  BorderVector border;
};

Faults noFaults() {
  Faults none;
  none.position_shift_s = none.rotation_shift_s = 0.0;
  none.turn.setZero();
  none.lever.setZero();
  none.tilt.setZero();
  none.position_white = none.rotation_white = 2e-4;
  none.position_smooth = none.rotation_smooth = 0.0;
  return none;
}

std::vector<OneFault> singleFaults() {
  std::vector<OneFault> all(5, {"", noFaults(), BorderVector::Zero()});
  all[0].name = "positions late";
  all[0].faults.position_shift_s = all[0].border[kPositionShift] = -0.03;
  all[1].name = "rotations early";
  all[1].faults.rotation_shift_s = all[1].border[kRotationShift] = 0.02;
  all[2].name = "body turned";
  all[2].faults.turn = {0.02, -0.05, 0.03};
  all[2].border.segment<3>(kTurn) = all[2].faults.turn;
  all[3].name = "body displaced";
  all[3].faults.lever = {0.05, -0.1, 0.03};
  all[3].border.segment<3>(kLever) = all[3].faults.lever;
  all[4].name = "world tilted";
  all[4].faults.tilt = {0.03, -0.02};
  // Gravity in G, against -9.81 along z.
  const Eigen::Vector3d up = expSO3(Eigen::Vector3d(0.03, -0.02, 0.0)).col(2);
  all[4].border.segment<3>(kGravity) = -9.81 * up + Eigen::Vector3d(0.0, 0.0, 9.81);
  return all;
}

/** The border after Gauss-Newton at the sizes of the priors, no low pass. */
struct Fitted {
  Eigen::Matrix<double, kBorderSize, 1> border, sigma;
};

Fitted fitOf(const SimulatedTruth& truth) {
  const ImuBuffer imu(truth.imu);
  FlightModel model(truth.recorded.states, imu, ImuNoiseDensities(), 0.25, 0.5);
  SizePriors priors = defaultSizePriors();
  priors[kPositionBandwidth] = priors[kRotationBandwidth] = {1e6, 0.0};
  Fitted fitted;
  fitted.border.setZero();
  for (int i = 0; i < 5; ++i) {
    const Linearisation linear = model.linearise();
    Likelihood likelihood(linear, priors);
    const auto estimate =
        estimateBorder(&likelihood, logOf(priors), blocksOf(linear.nodes, 2.0), {});
    Posterior posterior;
    EXPECT_TRUE(likelihood.solve(logOf(priors), &posterior));
    model.add(posterior.nodes, posterior.border);
    fitted.sigma = posterior.border_covariance.diagonal().cwiseSqrt();
    EXPECT_TRUE(estimate.move.isApprox(posterior.border));
  }
  const Shared& shared = model.shared();
  fitted.border << shared.position_shift_s, shared.rotation_shift_s, logSO3(shared.R_BM),
      shared.lever_B, shared.g_G + Eigen::Vector3d(0.0, 0.0, 9.81);
  return fitted;
}

TEST(OneFaultAlone, IsFoundAndNothingElse) {
  for (const OneFault& one : singleFaults()) {
    const Fitted fitted = fitOf(simulatedTruth(one.faults, 11, 13.0));
    for (int i = 0; i < kBorderSize; ++i)
      // The rows err by a fifth of what the priors say: three of their standard errors is far.
      EXPECT_LT(std::abs(fitted.border[i] - one.border[i]), 3.0 * fitted.sigma[i])
          << one.name << ", unknown " << i << ": " << fitted.border[i] << " +- " << fitted.sigma[i];
  }
}

TEST(OneFaultAlone, StandardErrorsAreSmallEnoughToTellThemApart) {
  const Fitted fitted = fitOf(simulatedTruth(noFaults(), 11, 13.0));
  EXPECT_LT(fitted.sigma[kPositionShift], 5e-3);
  EXPECT_LT(fitted.sigma[kRotationShift], 5e-3);
  EXPECT_LT(fitted.sigma.segment<3>(kTurn).maxCoeff(), 5e-3);
  EXPECT_LT(fitted.sigma.segment<3>(kLever).maxCoeff(), 2e-2);
}

/** Ten seconds, fitted at the sizes of the priors. */
class Jackknife : public ::testing::Test {
 protected:
  Jackknife()
      : truth_(simulatedTruth({}, 12, 11.0)),
        imu_(truth_.imu),
        model_(truth_.recorded.states, imu_, ImuNoiseDensities(), 0.25, 0.5) {
    linear_ = model_.linearise();
  }
  SimulatedTruth truth_;
  ImuBuffer imu_;
  FlightModel model_;
  Linearisation linear_;
};

TEST_F(Jackknife, VariancesAreNeverBelowTheModels) {
  Likelihood likelihood(linear_, defaultSizePriors());
  const SizeVector sizes = logOf(defaultSizePriors());
  Posterior posterior;
  ASSERT_TRUE(likelihood.solve(sizes, &posterior));
  const auto estimate =
      estimateBorder(&likelihood, sizes, blocksOf(linear_.nodes, 2.0), BorderMatrix::Zero());
  EXPECT_EQ(estimate.move, posterior.border);
  for (int i = 0; i < kBorderSize; ++i)
    EXPECT_GE(estimate.covariance(i, i), posterior.border_covariance(i, i) * (1.0 - 1e-12));
  // Correlations are the model's.
  const double rho =
      posterior.border_covariance(0, 1) /
      std::sqrt(posterior.border_covariance(0, 0) * posterior.border_covariance(1, 1));
  EXPECT_NEAR(estimate.covariance(0, 1),
              rho * std::sqrt(estimate.covariance(0, 0) * estimate.covariance(1, 1)),
              1e-9 * estimate.covariance(0, 0));
}

TEST_F(Jackknife, WhatTheSizesAddIsInIt) {
  Likelihood likelihood(linear_, defaultSizePriors());
  const SizeVector sizes = logOf(defaultSizePriors());
  BorderMatrix more = BorderMatrix::Zero();
  more(kPositionShift, kPositionShift) = 1.0;  // s^2: larger than anything else
  const auto estimate = estimateBorder(&likelihood, sizes, blocksOf(linear_.nodes, 2.0), more);
  EXPECT_NEAR(estimate.covariance(kPositionShift, kPositionShift), 1.0, 0.01);
}

// A block whose rows are late by 0.1 s more than the others is what the model cannot know.
TEST_F(Jackknife, DisagreementOfTheBlocksShows) {
  const SizeVector sizes = logOf(defaultSizePriors());
  const auto sigmaOfShift = [&](const Linearisation& linear) {
    Likelihood likelihood(linear, defaultSizePriors());
    const auto estimate =
        estimateBorder(&likelihood, sizes, blocksOf(linear.nodes, 2.0), BorderMatrix::Zero());
    return std::sqrt(estimate.covariance(kPositionShift, kPositionShift));
  };
  Linearisation torn = linear_;
  for (size_t k = torn.nodes.size() / 2; k < torn.nodes.size(); ++k) {
    Node& node = torn.nodes[k];
    node.T_GM.t -= 0.1 * truth_.R_GW * truth_.flight.at(node.body.t).v_WB;
  }
  EXPECT_GT(sigmaOfShift(torn), 2.0 * sigmaOfShift(linear_));
}

TEST_F(Jackknife, SizesThatAreKnownAreCertain) {
  SizePriors priors = defaultSizePriors();
  priors[kPositionBandwidth] = priors[kRotationBandwidth] = {1e6, 0.0};
  Likelihood likelihood(linear_, priors);
  const SizeUncertainty sizes =
      sizeUncertainty(&likelihood, logOf(priors), blocksOf(linear_.nodes, 2.0));
  for (const int known : {kPositionBandwidth, kRotationBandwidth}) {
    EXPECT_LT(sizes.covariance(known, known), 1e-11);
    EXPECT_EQ(sizes.border_by_size.col(known).norm(), 0.0);
  }
  // The gyro's walk cannot be seen in ten seconds: its prior's width is left, as a logarithm.
  EXPECT_NEAR(std::sqrt(sizes.covariance(kGyroWalkFactor, kGyroWalkFactor)), 0.1, 0.02);
}

}  // namespace
}  // namespace etalon::ground_truth
