// Where the IMU adds nothing it takes nothing away: flights at constant speed.

#include <gtest/gtest.h>

#include "steady_flight.h"

namespace etalon {
namespace {

constexpr int kFlights = 12;
constexpr double kRate = 10.0;        // of the frames, Hz
constexpr size_t kFirst = 5 * kRate;  // see driftOf()

/** Errors are those from kFirst on. */
struct FlownFlight {
  Trajectory trajectory;
  std::vector<bool> keyframes;
  Eigen::Matrix<double, 5, 1> nees = Eigen::Matrix<double, 5, 1>::Zero();  ///< mean
  double tilt = 0.0;      ///< of the worst frame, rad
  double velocity = 0.0;  ///< of the worst frame, in the axes of the body, m/s
};

/** @param seed of the start's errors
 * @param believed factor on the noise of gyro and accelerometer that the odometry is told */
FlownFlight fly(const SimulatedFlight& flight, std::uint64_t seed, double believed = 1.0) {
  FixedLagOptions options;
  options.imu_noise = flight.imu_noise;
  options.imu_noise.gyro_noise_density *= believed;
  options.imu_noise.accel_noise_density *= believed;
  options.sigma_px = SimulatedFlightOptions().sigma_px;
  FixedLagOdometry odometry(flight.calibration, options);
  FlownFlight flown;
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    const OdometryOutput out =
        i == 0 ? odometry.start(flight.startAt(0, startSigma(), seed), flight.frames[0])
               : odometry.process(flight.frames[i], flight.between(i - 1, i));
    flown.trajectory.push_back({out.t, out.state.T_WB});
    flown.keyframes.push_back(out.keyframe);
    if (i < kFirst) continue;
    const NavState& truth = flight.truth[i];
    flown.nees += neesOf(out, truth) / static_cast<double>(flight.frames.size() - kFirst);
    const Eigen::Matrix3d to_body = out.state.T_WB.R.transpose(),
                          to_true_body = truth.T_WB.R.transpose();
    flown.tilt = std::max(flown.tilt, (to_body.col(2) - to_true_body.col(2)).norm());
    flown.velocity =
        std::max(flown.velocity, (to_body * out.state.v_WB - to_true_body * truth.v_WB).norm());
  }
  return flown;
}

/** Twelve flights of 40 s at 0.8 m/s. */
void expectNothingTakenAway(double turn_rps) {
  DriftRms fixed_lag, useless_imu, stereo;
  Eigen::Matrix<double, 5, 1> nees = Eigen::Matrix<double, 5, 1>::Zero();
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    SimulatedFlightOptions options;
    options.seed = seed;
    options.frame_rate_hz = kRate;
    options.tracks = 60;
    const SimulatedFlight flight =
        simulateFlight(options, SteadyTrajectory(0.8, turn_rps, kUnderWay + 40.0));
    const FlownFlight flown = fly(flight, seed);
    fixed_lag.add(driftOf(flown.trajectory, flight, kFirst));
    useless_imu.add(driftOf(fly(flight, seed, 100.0).trajectory, flight, kFirst));
    stereo.add(driftOf(flyStereoAlone(flight, options.sigma_px, flown.keyframes), flight, kFirst));
    nees += flown.nees / kFlights;
    // By prior and start a level axis is known to 0.15 deg; 3.9 sigma of both together.
    EXPECT_LT(flown.tilt, 0.0105) << seed;
    EXPECT_LT(flown.velocity, 0.08) << seed;  // a tenth of the speed
  }
  const Drift with = fixed_lag.get(), without = useless_imu.get(), alone = stereo.get();
  // Against the same odometry with an IMU that it does not believe, on the same noise.
  EXPECT_LT(with.scale, 1.2 * without.scale);
  EXPECT_LT(with.ate, 1.2 * without.ate);
  // Against stereo odometry: of equal odometries one of eleven pairs of RMS values over twelve flights
  // would differ by more.
  EXPECT_LT(with.scale, 1.5 * alone.scale);
  EXPECT_LT(with.ate, 1.5 * alone.ate);
  EXPECT_LT(with.rotation, 1.5 * alone.rotation);
  // All but the velocity hardly change in such a flight: twelve flights are 36 numbers, whose mean
  // square is known to a quarter.
  for (int b = 0; b < 5; ++b)
    EXPECT_LT(nees[b], b == 2 ? 1.25 : 1.7) << b << ": " << nees.transpose();
}

TEST(WeakExcitation, OnAStraightLineTheScaleStaysTheStereoRigs) { expectNothingTakenAway(0.0); }

TEST(WeakExcitation, OnACircleTheScaleStaysTheStereoRigs) { expectNothingTakenAway(0.2); }

}  // namespace
}  // namespace etalon
