#include "etalon/evaluation/ground_truth_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "etalon/core/so3.h"
#include "etalon/evaluation/metrics.h"
#include "etalon/imu/preintegration.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kDegrees = 180.0 / M_PI;

struct Flight {
  GroundTruth truth;
  std::vector<ImuSample> imu;
};

/** A flight with exact ground truth at 200 Hz in its own gravity-aligned world. */
Flight fly(MotionProfile profile, const ImuSynthesisOptions& imu, double truth_rate_hz = 200.0) {
  ProfileOptions options;
  options.profile = profile;
  options.duration_s = 20.0;
  const ProfileTrajectory trajectory(options);
  Flight flight;
  flight.imu = synthesizeImu(trajectory, trajectory.start(), trajectory.end(), imu).samples;
  flight.truth.has_velocity = true;
  const int rows = static_cast<int>(options.duration_s * truth_rate_hz);
  for (int k = 0; k <= rows; ++k) {
    const TrajectoryState s = trajectory.at(stampAtRate(trajectory.start(), truth_rate_hz, k));
    flight.truth.states.push_back({s.t, s.T_WB, s.v_WB});
  }
  return flight;
}

ImuSynthesisOptions biased() {
  ImuSynthesisOptions options = ImuSynthesisOptions::noiseFree();
  options.initial_bias = {Vector3d(-0.002, 0.021, 0.077), Vector3d(-0.02, 0.13, 0.06)};
  return options;
}

TEST(GroundTruthCheck, IsZeroForAnExactTruth) {
  const Flight flight = fly(MotionProfile::kAggressive, ImuSynthesisOptions::noiseFree());
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_EQ(check.interval_s, 0.25);
  // What preintegration at 200 Hz leaves of a flight with up to 3 rad/s: second order in 5 ms.
  EXPECT_LT(check.rre_deg, 1e-3);
  EXPECT_LT(check.bias.gyro.norm(), 2e-5);
  EXPECT_LT(check.bias.accel.norm(), 2e-4);
  EXPECT_LT(check.world_tilt_deg, 2e-3);
}

TEST(GroundTruthCheck, FindsTheBiases) {
  const Flight flight = fly(MotionProfile::kAggressive, biased());
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_LT((check.bias.gyro - biased().initial_bias.gyro).norm(), 2e-5);
  EXPECT_LT((check.bias.accel - biased().initial_bias.accel).norm(), 2e-4);
  EXPECT_LT(check.rre_deg, 1e-3);
  EXPECT_LT(check.world_tilt_deg, 2e-3);
}

TEST(GroundTruthCheck, FindsTheTiltOfTheTruthsWorldWithAndWithoutVelocities) {
  Flight flight = fly(MotionProfile::kGentle, biased());
  const SE3 T_GW(expSO3(Vector3d(0.6, -0.8, 0.0) * 0.55 / kDegrees), Vector3d(1, 2, 3));
  for (StampedState& s : flight.truth.states) {
    s.T_WB = T_GW * s.T_WB;
    s.v_WB = T_GW.R * s.v_WB;
  }
  for (const bool has_velocity : {true, false}) {
    flight.truth.has_velocity = has_velocity;
    if (!has_velocity)
      for (StampedState& s : flight.truth.states) s.v_WB.setZero();
    const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
    EXPECT_NEAR(check.world_tilt_deg, 0.55, 2e-3) << has_velocity;
    ASSERT_TRUE(check.foundGravityDirection().has_value());
    EXPECT_EQ(*check.foundGravityDirection(), check.gravity_direction_G);
    EXPECT_LT((check.gravity_direction_G - T_GW.R * Vector3d(0, 0, -1)).norm() * kDegrees, 2e-3);
    EXPECT_LT((check.bias.accel - biased().initial_bias.accel).norm(), 2e-4);
    EXPECT_LT(check.rre_deg, 1e-3);  // a tilt of the world turns no relative rotation
  }
}

TEST(GroundTruthCheck, MeasuresTheNoiseOfTheTruthsRotations) {
  Flight flight = fly(MotionProfile::kGentle, biased());
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  const double sigma = 0.02 / kDegrees;
  for (StampedState& s : flight.truth.states)
    s.T_WB.R *= expSO3(sigma * Vector3d(normal(generator), normal(generator), normal(generator)));
  // Two ends, three axes: sqrt(6) sigma, from 80 intervals of 3 components: 6 %, of which 3 sigma.
  EXPECT_NEAR(checkGroundTruth(flight.truth, flight.imu).rre_deg, std::sqrt(6.0) * 0.02,
              0.2 * std::sqrt(6.0) * 0.02);
}

TEST(GroundTruthCheck, MeasuresTheNoiseOfTheGyro) {
  ImuSynthesisOptions noisy = biased();
  noisy.white_noise = true;
  noisy.noise.gyro_noise_density = 2e-3;
  noisy.noise.accel_noise_density = 0.0;
  const Flight flight = fly(MotionProfile::kGentle, noisy);
  // sigma_c sqrt(interval) an axis.
  const double expected = 2e-3 * std::sqrt(3 * 0.25) * kDegrees;
  EXPECT_NEAR(checkGroundTruth(flight.truth, flight.imu).rre_deg, expected, 0.2 * expected);
}

TEST(GroundTruthCheck, TakesTheTruthsOwnStatesAtALowRate) {
  const Flight flight = fly(MotionProfile::kAggressive, biased(), 20.0);
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_LT(check.rre_deg, 1e-3);
  EXPECT_LT(check.world_tilt_deg, 2e-3);
}

TEST(GroundTruthCheck, LeavesOutWhatEitherDoesNotCover) {
  Flight flight = fly(MotionProfile::kAggressive, biased());
  auto& states = flight.truth.states;
  states.erase(states.begin() + 1000, states.begin() + 1600);
  flight.imu.erase(flight.imu.begin() + 2000, flight.imu.begin() + 2100);
  flight.imu.resize(3500);
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_LT(check.rre_deg, 1e-3);
  EXPECT_LT(check.world_tilt_deg, 2e-3);
}

TEST(GroundTruthCheck, AStrayStampChangesNothing) {
  Flight flight = fly(MotionProfile::kGentle, biased());
  const GroundTruthCheck clean = checkGroundTruth(flight.truth, flight.imu);
  StampedState stray = flight.truth.states.front();
  stray.t = 1000;  // 44 years before: 5.6e9 steps of 0.25 s
  flight.truth.states.insert(flight.truth.states.begin(), stray);
  stray.t = 4'000'000'000'000'000'000;
  flight.truth.states.push_back(stray);
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  // The intervals begin elsewhere: what preintegration leaves of them, as for an exact truth above.
  EXPECT_NEAR(check.rre_deg, clean.rre_deg, 1e-3);
  EXPECT_LT((check.bias.gyro - clean.bias.gyro).norm(), 2e-5);
}

TEST(GroundTruthCheck, AtRestGravityCannotBeToldFromTheAccelerometersBias) {
  const Flight flight = fly(MotionProfile::kStatic, biased());
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_LT((check.bias.gyro - biased().initial_bias.gyro).norm(), 1e-9);
  EXPECT_LT(check.rre_deg, 1e-6);
  EXPECT_TRUE(std::isnan(check.world_tilt_deg));
  EXPECT_TRUE(std::isnan(check.bias.accel.x()));
  EXPECT_EQ(check.gravity_direction_G, Vector3d(0, 0, -1));
  EXPECT_FALSE(check.foundGravityDirection().has_value());
}

TEST(GroundTruthCheck, OfAShortRecordingGravityIsNotFoundFromNoisySamples) {
  ImuSynthesisOptions noisy = biased();
  noisy.white_noise = true;
  noisy.noise.gyro_noise_density = 0.0;
  noisy.noise.accel_noise_density = 0.01;  // five times the data sheet: a flight
  Flight flight = fly(MotionProfile::kGentle, noisy);
  EXPECT_TRUE(checkGroundTruth(flight.truth, flight.imu).foundGravityDirection().has_value());
  flight.truth.states.resize(1200);  // 6 s, of which one at rest
  const GroundTruthCheck check = checkGroundTruth(flight.truth, flight.imu);
  EXPECT_FALSE(check.foundGravityDirection().has_value());
  EXPECT_FALSE(std::isnan(check.rre_deg));
}

TEST(GroundTruthCheck, WithoutTruthOrImuThereIsNone) {
  const Flight flight = fly(MotionProfile::kGentle, biased());
  for (const GroundTruthCheck& check :
       {checkGroundTruth({}, flight.imu), checkGroundTruth(flight.truth, {}),
        checkGroundTruth(flight.truth, flight.imu, 100.0)}) {
    EXPECT_TRUE(std::isnan(check.rre_deg));
    EXPECT_TRUE(std::isnan(check.interval_s));
    EXPECT_TRUE(std::isnan(check.bias.gyro.x()));
    EXPECT_TRUE(std::isnan(check.world_tilt_deg));
    EXPECT_EQ(check.gravity_direction_G, Vector3d(0, 0, -1));
  }
}

std::vector<TimeNs> keyframesOf(const Flight& flight, double start_s, double rate_hz = 4.0) {
  std::vector<TimeNs> stamps;
  for (int k = 0; k < 10; ++k)
    stamps.push_back(flight.truth.states.front().t + durationNs(start_s + k / rate_hz));
  return stamps;
}

/** RRE of keyframes whose rotations are integrated from the gyro, less `bias`. */
double rreOfIntegration(const Flight& flight, const std::vector<TimeNs>& stamps,
                        const Vector3d& bias) {
  const ImuBuffer imu(flight.imu);
  std::vector<StampedState> states(stamps.size());
  for (size_t k = 0; k < stamps.size(); ++k) {
    states[k].t = stamps[k];
    if (k > 0)
      states[k].T_WB.R =
          states[k - 1].T_WB.R *
          Preintegration(imu.between(stamps[k - 1], stamps[k]), {bias, Vector3d::Zero()}, {})
              .deltas()
              .dR;
  }
  return evaluateWindow(states, {}, flight.truth).rre_deg;
}

TEST(WindowTruthCheck, FollowsABiasThatChanges) {
  Flight flight = fly(MotionProfile::kGentle, biased());
  // A bias that drifts by 0.02 rad/s in 20 s, as no constant can follow.
  for (ImuSample& sample : flight.imu)
    sample.gyro.x() += 1e-3 * secondsBetween(flight.imu.front().t, sample.t);
  const ImuBuffer imu(flight.imu);
  for (const double start_s : {2.0, 9.0, 16.0}) {
    const double bound = checkWindowTruth(flight.truth, imu, keyframesOf(flight, start_s)).rre_deg;
    // Within 2.25 s the bias leaves +-1e-3 rad/s: RMS 0.25 s * 2.25e-3 / sqrt(12) = 0.0093 deg.
    EXPECT_NEAR(bound, 0.0093, 0.001) << start_s;
    EXPECT_GT(checkGroundTruth(flight.truth, flight.imu).rre_deg, 5 * bound);
  }
}

TEST(WindowTruthCheck, IsTheLeastThatIntegrationCanHave) {
  ImuSynthesisOptions noisy = biased();
  noisy.white_noise = true;
  noisy.noise.gyro_noise_density = 2e-3;
  noisy.noise.accel_noise_density = 0.0;
  const Flight flight = fly(MotionProfile::kAggressive, noisy);
  for (const double rate_hz : {4.0, 10.0}) {
    const std::vector<TimeNs> stamps = keyframesOf(flight, 5.0, rate_hz);
    const double bound = checkWindowTruth(flight.truth, ImuBuffer(flight.imu), stamps).rre_deg;
    EXPECT_GT(rreOfIntegration(flight, stamps, noisy.initial_bias.gyro), bound);
    // A coarse search over the bias comes near it and never below.
    double least = 1e9, step = 4e-3;
    Vector3d best = noisy.initial_bias.gyro;
    for (int round = 0; round < 8; ++round, step /= 2) {
      const Vector3d centre = best;
      for (int i = 0; i < 27; ++i) {
        const Vector3d bias = centre + step * Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        const double rre = rreOfIntegration(flight, stamps, bias);
        if (rre < least) best = bias;
        least = std::min(least, rre);
      }
    }
    EXPECT_GE(least, bound * (1 - 1e-9)) << rate_hz;
    EXPECT_LT(least, bound * 1.01) << rate_hz;
  }
}

TEST(WindowTruthCheck, OfTheBiasIsWhatTheGroundTruthStatesWrongly) {
  Flight flight = fly(MotionProfile::kAggressive, biased());
  const ImuBuffer imu(flight.imu);
  const std::vector<TimeNs> stamps = keyframesOf(flight, 5.0);
  EXPECT_TRUE(std::isnan(checkWindowTruth(flight.truth, imu, stamps).gyro_bias_rps));
  flight.truth.has_biases = true;
  for (StampedState& s : flight.truth.states)
    s.bias.gyro = biased().initial_bias.gyro + Vector3d(0.002, 0.0, -0.001);
  // The fit itself is good to 2e-5 rad/s (FindsTheBiases).
  EXPECT_NEAR(checkWindowTruth(flight.truth, imu, stamps).gyro_bias_rps, std::hypot(0.002, 0.001),
              2e-5);
}

TEST(WindowTruthCheck, FindsTheStepThatTheAccelerometerDidNotFeel) {
  ImuSynthesisOptions options = biased();
  Flight flight = fly(MotionProfile::kAggressive, options);
  ASSERT_TRUE(flight.truth.has_velocity);
  const ImuBuffer imu(flight.imu);
  const std::vector<TimeNs> stamps = keyframesOf(flight, 5.0);
  EXPECT_LT(checkWindowTruth(flight.truth, imu, stamps).velocity_step_mps, 1e-3);
  for (StampedState& state : flight.truth.states)
    if (state.t > stamps[4]) state.v_WB.y() += 0.09;
  // An interval of nine has it, and the bias that fits best takes a ninth of it away.
  EXPECT_NEAR(checkWindowTruth(flight.truth, imu, stamps).velocity_step_mps, 0.09 * 8 / 9, 0.005);
  EXPECT_TRUE(std::isnan(
      checkWindowTruth(flight.truth, imu, {stamps.begin(), stamps.begin() + 3}).velocity_step_mps));
  flight.truth.has_velocity = false;
  EXPECT_TRUE(std::isnan(checkWindowTruth(flight.truth, imu, stamps).velocity_step_mps));
}

TEST(WindowTruthCheck, LeavesOutWhatIsNotCovered) {
  Flight flight = fly(MotionProfile::kGentle, biased());
  const std::vector<TimeNs> stamps =
      keyframesOf(flight, 18.5);  // to 20.75 s; the flight ends at 20
  EXPECT_LT(checkWindowTruth(flight.truth, ImuBuffer(flight.imu), stamps).rre_deg, 1e-3);
  EXPECT_TRUE(std::isnan(checkWindowTruth({}, ImuBuffer(flight.imu), stamps).rre_deg));
  EXPECT_TRUE(std::isnan(checkWindowTruth(flight.truth, ImuBuffer(), stamps).rre_deg));
  EXPECT_TRUE(
      std::isnan(checkWindowTruth(flight.truth, ImuBuffer(flight.imu), {stamps[0]}).rre_deg));
}

}  // namespace
}  // namespace etalon
