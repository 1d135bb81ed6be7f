// Biases that jump in flight: recognised, said once, and hardly felt.

#include <gtest/gtest.h>

#include "simulated_flight.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kJumpAt = 6.0;  // s after the first frame

SimulatedFlight flightWithJump(std::uint64_t seed, const Vector3d& gyro, const Vector3d& accel) {
  SimulatedFlightOptions options;
  options.duration_s = 9.0;
  options.tracks = 100;
  options.seed = seed;
  SimulatedFlight flight = simulateFlight(options);
  const TimeNs from = flight.frames[0].t + durationNs(kJumpAt);
  std::vector<ImuSample> samples = flight.imu.samples();
  for (ImuSample& sample : samples) {
    if (sample.t < from) continue;
    sample.gyro += gyro;
    sample.accel += accel;
  }
  flight.imu = ImuBuffer(std::move(samples));
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    if (flight.frames[i].t < from) continue;
    flight.truth[i].bias.gyro += gyro;
    flight.truth[i].bias.accel += accel;
  }
  return flight;
}

struct AfterJump {
  std::vector<double> said_s;               ///< after the jump
  double gyro_rps = 0.0, accel_mps2 = 0.0;  ///< errors of the biases at the end
  double largest_m = 0.0;                   ///< by which the position moves away after the jump
};

AfterJump flyThroughJump(const SimulatedFlight& flight, double chi2) {
  FixedLagOptions options;
  options.imu_noise = flight.imu_noise;
  options.sigma_px = SimulatedFlightOptions().sigma_px;
  options.chi2_bias_jump = chi2;
  FixedLagOdometry odometry(flight.calibration, options);
  odometry.start(flight.startAt(0, startSigma(), 7), flight.frames[0]);
  AfterJump flown;
  SE3 before;  // of truth in the estimate, at the last frame before the jump
  for (size_t i = 1; i < flight.frames.size(); ++i) {
    const OdometryOutput out = odometry.process(flight.frames[i], flight.between(i - 1, i));
    const double t = secondsBetween(flight.frames[0].t, out.t) - kJumpAt;
    for (size_t k = 0; k < out.remarks.size(); ++k) flown.said_s.push_back(t);
    if (t < 0.0)
      before = out.state.T_WB * flight.truth[i].T_WB.inverse();
    else
      flown.largest_m =
          std::max(flown.largest_m, (out.state.T_WB.t - before * flight.truth[i].T_WB.t).norm());
    flown.gyro_rps = (out.state.bias.gyro - flight.truth[i].bias.gyro).norm();
    flown.accel_mps2 = (out.state.bias.accel - flight.truth[i].bias.accel).norm();
  }
  return flown;
}

constexpr double kNever = 1e9;

TEST(BiasJump, IsFollowedAndSaid) {
  const Vector3d gyro(0.006, -0.005, 0.004), accel(0.15, -0.15, 0.17);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const SimulatedFlight flight = flightWithJump(seed, gyro, accel);
    const AfterJump followed = flyThroughJump(flight, FixedLagOptions().chi2_bias_jump);
    ASSERT_EQ(followed.said_s.size(), 1U) << "seed " << seed;
    EXPECT_GE(followed.said_s[0], 0.0);
    EXPECT_LT(followed.said_s[0], 0.6);
    const AfterJump not_followed = flyThroughJump(flight, kNever);
    EXPECT_TRUE(not_followed.said_s.empty());
    EXPECT_LT(followed.gyro_rps, 0.001);
    EXPECT_LT(followed.gyro_rps, 0.5 * not_followed.gyro_rps);
    EXPECT_LT(followed.accel_mps2, not_followed.accel_mps2);
    EXPECT_LT(followed.largest_m, not_followed.largest_m);
  }
}

TEST(BiasJump, IsNotSeenWhereThereIsNone) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const SimulatedFlight flight = flightWithJump(seed, Vector3d::Zero(), Vector3d::Zero());
    EXPECT_TRUE(flyThroughJump(flight, FixedLagOptions().chi2_bias_jump).said_s.empty())
        << "seed " << seed;
  }
}

TEST(BiasJump, ASingleWrongSampleIsNone) {
  SimulatedFlight flight = flightWithJump(1, Vector3d::Zero(), Vector3d::Zero());
  std::vector<ImuSample> samples = flight.imu.samples();
  samples[samples.size() / 2].gyro += Vector3d(0.3, 0.0, 0.0);
  flight.imu = ImuBuffer(std::move(samples));
  EXPECT_TRUE(flyThroughJump(flight, FixedLagOptions().chi2_bias_jump).said_s.empty());
}

}  // namespace
}  // namespace etalon
