#include "etalon/evaluation/gyro_agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

const Vector3d kBias(-0.002, 0.021, 0.077);  // rad/s
const double kDensity = ImuNoiseDensities().gyro_noise_density;

/** Ten seconds of flight: a gyro with the data sheet's white noise, and the exact truth at 200 Hz.
 */
struct TurningFlight {
  GroundTruth truth;
  std::vector<ImuSample> imu;

  TurningFlight() {
    ProfileOptions options;
    options.profile = MotionProfile::kAggressive;
    options.duration_s = 10.0;
    const ProfileTrajectory trajectory(options);
    ImuSynthesisOptions noise = ImuSynthesisOptions::noiseFree();
    noise.white_noise = true;
    noise.initial_bias.gyro = kBias;
    imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(), noise).samples;
    for (const ImuSample& sample : imu)
      truth.states.push_back({sample.t, trajectory.at(sample.t).T_WB});
  }

  GyroAgreement agreement() const { return gyroAgreement(truth, imu, kBias, kDensity); }
};

TEST(GyroAgreement, AnIndependentTruthDiffersByTheGyrosNoise) {
  TurningFlight flight;
  const GyroAgreement exact = flight.agreement();
  // A midpoint step averages two samples: sqrt(1/2). 2000 steps of 3 components, neighbours with a
  // correlation of 0.5: 1.5 % and, for the median, 2 %.
  EXPECT_NEAR(exact.rms, std::sqrt(0.5), 0.05);
  EXPECT_NEAR(exact.median, std::sqrt(0.5), 0.06);
  EXPECT_FALSE(exact.isCopy());
  // A motion capture's rotations, good to 0.02 deg.
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0.0, 0.02 * M_PI / 180.0);
  for (StampedState& s : flight.truth.states)
    s.T_WB.R *= expSO3(Vector3d(normal(generator), normal(generator), normal(generator)));
  EXPECT_GT(flight.agreement().median, 10.0);
  EXPECT_FALSE(flight.agreement().isCopy());
}

/** The truth's rotations from now on as the gyro's. */
void copyGyro(TurningFlight* flight) {
  const ImuBuffer imu(flight->imu);
  std::vector<StampedState>& states = flight->truth.states;
  for (size_t k = 1; k < states.size(); ++k)
    states[k].T_WB.R =
        states[k - 1].T_WB.R *
        Preintegration(imu.between(states[k - 1].t, states[k].t), {kBias, Vector3d::Zero()}, {})
            .deltas()
            .dR;
}

TEST(GyroAgreement, ATruthThatIsTheSmoothedGyroIsFound) {
  TurningFlight flight;
  copyGyro(&flight);
  EXPECT_LT(flight.agreement().median, 0.01);
  EXPECT_LT(flight.agreement().rms, 1.0);
  EXPECT_TRUE(flight.agreement().isCopy());
  // Its own biases, where it states them, are what it was integrated with.
  flight.truth.has_biases = true;
  EXPECT_GT(flight.agreement().median, 1.0);  // they are stated as zero
  for (StampedState& s : flight.truth.states) s.bias.gyro = kBias;
  EXPECT_TRUE(flight.agreement().isCopy());
}

TEST(GyroAgreement, CorrectionsLargerThanTheNoiseAreTheTruthsOwn) {
  TurningFlight flight;
  std::mt19937 generator(4);
  std::normal_distribution<double> normal(0.0, 0.02 * M_PI / 180.0);
  copyGyro(&flight);
  for (size_t k = 0; k < flight.truth.states.size(); ++k)
    if (k % 10 == 0) {
      const Eigen::Matrix3d jump =
          expSO3(Vector3d(normal(generator), normal(generator), normal(generator)));
      for (size_t i = k; i < flight.truth.states.size(); ++i) flight.truth.states[i].T_WB.R *= jump;
    }
  EXPECT_GT(flight.agreement().rms, 1.0);
  EXPECT_FALSE(flight.agreement().isCopy());
}

TEST(GyroAgreement, WhereTheImuHasAGapNothingIsCompared) {
  TurningFlight flight;
  copyGyro(&flight);
  flight.imu.erase(flight.imu.begin() + 800, flight.imu.begin() + 1000);
  EXPECT_LT(flight.agreement().rms, 0.01);
  EXPECT_TRUE(flight.agreement().isCopy());
}

TEST(GyroAgreement, WhatCannotBeToldIsNotSaid) {
  TurningFlight flight;
  EXPECT_TRUE(std::isnan(gyroAgreement(flight.truth, flight.imu, kBias, 0.0).median));
  EXPECT_TRUE(std::isnan(gyroAgreement({}, flight.imu, kBias, kDensity).rms));
  EXPECT_TRUE(std::isnan(gyroAgreement(flight.truth, {}, kBias, kDensity).rms));
  GroundTruth sparse;  // 20 Hz
  for (size_t k = 0; k < flight.truth.states.size(); k += 10)
    sparse.states.push_back(flight.truth.states[k]);
  EXPECT_TRUE(std::isnan(gyroAgreement(sparse, flight.imu, kBias, kDensity).rms));
}

}  // namespace
}  // namespace etalon
