#include "etalon/benchmark/calibration/flight_over_tracks.h"

#include <gtest/gtest.h>

#include "etalon/pipeline/flight_bias.h"
#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/track_synthesis.h"
#include "inertial_only_initializer.h"

namespace etalon {
namespace {

using noise_test::TestInitializer;

constexpr double kImuRateHz = 200.0, kFrameRateHz = 10.0;

ProfileTrajectory trajectory() {
  ProfileOptions flight;
  flight.profile = MotionProfile::kAggressive;
  flight.seed = 4;
  flight.rest_s = 0.5;
  flight.take_off_s = 2.0;
  flight.duration_s = 33.0;
  return ProfileTrajectory(flight);
}

/** Thirty seconds under way, with constant biases and the data sheet's noise. */
SequenceTracks simulatedTracks(ImuBias* bias) {
  const ProfileTrajectory flight = trajectory();
  SequenceTracks tracks;
  tracks.calibration = eurocCalibration();
  ImuSynthesisOptions imu;
  imu.rate_hz = kImuRateHz;
  imu.noise = tracks.calibration.imu.noise;
  imu.bias_walk = false;
  imu.initial_bias = *bias = randomImuBias(4);
  tracks.imu = ImuBuffer(synthesizeImu(flight, flight.start(), flight.end(), imu).samples);
  std::vector<TimeNs> stamps;
  for (int k = 0; k < 300; ++k)
    stamps.push_back(flight.start() + durationNs(2.0 + k / kFrameRateHz));
  tracks.first_image = stamps.front();
  TrackSynthesisOptions options;
  options.sigma_px = 0.25;
  options.max_tracks = 60;
  tracks.frames = simulateTracks(posesAt(flight, stamps), tracks.calibration,
                                 scatterLandmarks(flight, 1000, 4), options);
  return tracks;
}

PipelineOptions options() {
  PipelineOptions options;
  options.imu_noise.gyro_noise_factor = options.imu_noise.accel_noise_factor = 1.0;
  return options;
}

TEST(FlightOverTracks, FindsTheBiasesOfTheFlight) {
  ImuBias truth;
  const SequenceTracks tracks = simulatedTracks(&truth);
  const std::vector<FrameEstimate> estimates = flyOverTracks(tracks, options(), TestInitializer());
  ASSERT_GT(estimates.size(), 260U);  // from the first window's last keyframe on
  const auto bias = biasOfFlight(estimates, options().window.priors);
  ASSERT_TRUE(bias) << bias.error().reason;
  // Three standard errors; the odometry believes in the data sheet's walk, which is none here.
  EXPECT_LT((bias->accel.mean - truth.accel).cwiseQuotient(bias->accel.sigma).norm(), 3.0 * 1.73);
  EXPECT_LT((bias->gyro.mean - truth.gyro).cwiseQuotient(bias->gyro.sigma).norm(), 3.0 * 1.73);
  EXPECT_LT(bias->accel.sigma.maxCoeff(), 0.01);
  EXPECT_LT(bias->gyro.sigma.maxCoeff(), 2e-4);
}

TEST(FlightOverTracks, WithoutAStartThereIsNoFlight) {
  EXPECT_TRUE(flyOverTracks(SequenceTracks(), options(), TestInitializer()).empty());
  ImuBias bias;
  SequenceTracks blind = simulatedTracks(&bias);
  blind.frames.resize(40);
  for (TrackedFrame& frame : blind.frames) frame.observations.clear();
  EXPECT_FALSE(firstStart(blind, options(), TestInitializer()));
}

TEST(FlightOverTracks, EndsWhereTheOdometryIsLost) {
  ImuBias bias;
  SequenceTracks tracks = simulatedTracks(&bias);
  for (size_t i = 100; i < tracks.frames.size(); ++i) tracks.frames[i].observations.clear();
  PipelineOptions five_seconds = options();
  five_seconds.max_dead_reckoning_s = 5.0;
  const std::vector<FrameEstimate> estimates =
      flyOverTracks(tracks, five_seconds, TestInitializer());
  ASSERT_FALSE(estimates.empty());
  EXPECT_EQ(estimates.back().state, PipelineState::kLost);
  EXPECT_NEAR(secondsBetween(tracks.frames[99].t, estimates.back().t), 5.1, 0.11);
}

}  // namespace
}  // namespace etalon
